"""What was found, or the textbook's model: the answer.

What the search named leaves, where it acts on several joints and is missed on one of them at most,
unless the model with all of that predicts new recordings better (`comparison`). Of this, with the
friction and rotors of the textbook beside it (`elsewhere`), and the textbook's model the one with
fewer parameters is the answer, unless the other predicts better by 2 % of the error.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.comparison import Comparison
from excite_cli.diagnosis.elsewhere import those_that_matter, with_everyday
from excite_cli.diagnosis.textbook import everyday
from excite_cli.diagnosis.tracing import Traced


def comparison_of(traced: Traced) -> Comparison:
    """Of models of what was found and of the textbook's effects."""
    members = {*traced.chosen, *everyday(traced.candidates)}
    return Comparison(traced.data, traced.candidates, members, traced.levels)


def sufficient(traced: Traced, models: Comparison) -> list[int]:
    """The candidates found, with what every robot has, or the textbook's."""
    plain = traced.plain
    every, found = (
        with_everyday(traced, some) for some in (traced.chosen, _seen_on_several(traced, models))
    )
    if models.difference(found, every).better:
        found = every
    best, larger = sorted((plain, found), key=lambda some: _width(traced, some))
    gained = models.difference(best, larger)
    if gained.better and gained.of_error > np.log(rules.AS_GOOD):
        best = larger
    return those_that_matter(traced, best)


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
