"""The smallest sufficient model: without what data left out do not miss.

What the search named leaves one by one, the weakest first, as long as its size cannot be, or is too
small to matter, or the model with it does not predict data left out better (`comparison`). Where
what remains does not predict new recordings better than the textbook, the textbook is the answer.
"""

import numpy as np

from excite_cli.diagnosis.comparison import Comparison
from excite_cli.diagnosis.records import AS_GOOD
from excite_cli.diagnosis.textbook import everyday, textbook
from excite_cli.diagnosis.tracing import Traced

# Of the torque's RMS: what is smaller needs no name. Beside friction that grows with load, dry
# friction of 0.3 % that nobody had put in predicted better (what the columns of load leave).
_SMALLEST = 5e-3


def comparison_of(traced: Traced) -> Comparison:
    """Of models of what was found and of the textbook's effects."""
    members = {*traced.chosen, *everyday(traced.candidates)}
    return Comparison(traced.data, traced.candidates, members, traced.levels, traced.noise)


def sufficient(traced: Traced, models: Comparison) -> list[int]:
    """The candidates found that are needed, or the textbook's."""
    kept = _needed(traced, models)
    plain = textbook(traced.candidates, models)
    if set(kept) <= set(plain):  # the smaller stays unless it is clearly worse
        more = models.error_of_new(kept) - models.error_of_new(plain)
        worse = more > np.log(AS_GOOD) and models.as_new(kept, plain).better
        return plain if worse else kept
    return kept if models.as_new(plain, kept).size > 0.0 else plain


def _needed(traced: Traced, models: Comparison) -> list[int]:
    judge, chosen = traced.judge, list(traced.chosen)
    while chosen:
        sizes = judge.plain.solve(chosen)
        idle = {}
        for i, gain in models.needed(chosen).items():
            rest = [k for k in chosen if k != i]
            if not judge.allowed(sizes, chosen, [i]):
                idle[i] = -np.inf
            elif judge.told_by_weight(i, rest):
                continue
            elif not gain.better or judge.size(rest, [i], judge.white.rows_of[i]) < _SMALLEST:
                idle[i] = gain.clearness
        if not idle:
            break
        weakest = min(idle, key=lambda i: idle[i])
        chosen = [k for k in chosen if k != weakest]
    return chosen
