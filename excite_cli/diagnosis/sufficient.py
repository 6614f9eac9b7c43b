"""What was found, or the textbook's model: the answer.

What the search named, and what of it is seen on more than one joint where it acts on several, each
with the friction and rotors of the textbook beside it (`elsewhere`), and the textbook's model: of
these the one with the fewest parameters is the answer, unless a larger one predicts new recordings
better (`comparison`), by 2 % of the error.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.comparison import Comparison
from excite_cli.diagnosis.elsewhere import those_that_matter, with_everyday
from excite_cli.diagnosis.textbook import everyday, textbook
from excite_cli.diagnosis.tracing import Traced


def comparison_of(traced: Traced) -> Comparison:
    """Of models of what was found and of the textbook's effects."""
    members = {*traced.chosen, *everyday(traced.candidates)}
    return Comparison(traced.data, traced.candidates, members, traced.levels)


def sufficient(traced: Traced, models: Comparison) -> list[int]:
    """The candidates found, with what every robot has, or the textbook's."""
    plain = those_that_matter(traced, textbook(traced.candidates, models))
    found = (traced.chosen, _seen_on_several(traced, models))
    sets = [plain, *(with_everyday(traced, some) for some in found)]
    best, *larger = sorted(sets, key=lambda some: _width(traced, some))
    for some in larger:
        gained = models.difference(best, some)
        if gained.better and gained.of_error > np.log(rules.AS_GOOD):
            best = some
    return best


def _seen_on_several(traced: Traced, models: Comparison) -> list[int]:
    """What was found, but for what acts on several joints and is missed on one of them at most."""
    judge, found = traced.judge, list(traced.chosen)
    while True:
        doubtful = {
            i: judge.white.gain_of(i, found).chi2
            for i in found
            if len(rows := traced.candidates[i].rows) > 1
            and not models.missed(found, judge.without(i, found), rows)
        }
        if not doubtful:
            return found
        found = judge.without(min(doubtful, key=doubtful.__getitem__), found)


def _width(traced: Traced, some: Sequence[int]) -> int:
    """Number of parameters."""
    return sum(traced.candidates[i].width for i in some)
