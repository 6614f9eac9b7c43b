"""The smallest sufficient model: without what data left out do not miss.

What the search named leaves one by one, the weakest first, as long as the model with it does not
predict data left out better (`comparison`). Where what remains does not predict new recordings
better than the textbook, the textbook is the answer.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.comparison import as_new, difference, left_out
from excite_cli.diagnosis.judgement import Judgement
from excite_cli.diagnosis.records import AS_GOOD
from excite_cli.diagnosis.textbook import textbook


def sufficient(judge: Judgement, found: Sequence[int]) -> list[int]:
    """The candidates of `found` that are needed, or the textbook's."""
    kept = _needed(judge, list(found))
    plain = textbook(judge)
    if set(kept) <= set(plain):  # the smaller stays unless it is clearly worse
        more = left_out(judge.plain, kept) - left_out(judge.plain, plain)
        worse = more > np.log(AS_GOOD) and as_new(judge, kept, plain).better
        return plain if worse else kept
    return kept if as_new(judge, plain, kept).size > 0.0 else plain


def _needed(judge: Judgement, chosen: list[int]) -> list[int]:
    while True:
        weakest: tuple[float, list[int]] | None = None
        for i in chosen:
            rest = judge.without(i, chosen)
            if judge.told_by_weight(i, rest) or judge.bound(i, chosen):
                continue
            gained = difference(judge, rest, chosen)
            if not gained.better and (weakest is None or gained.size < weakest[0]):
                weakest = (gained.size, rest)
        if weakest is None:
            return chosen
        chosen = weakest[1]
