"""The smallest sufficient model: without what data left out do not miss.

What the search named leaves one by one, the weakest first, as long as its size cannot be, or is too
small to matter, or the model with it does not predict data left out better (`comparison`); but not
what leaves others, which are needed, with sizes that cannot be. Of what remains and the textbook
the smaller is the answer, unless the larger predicts new recordings better. Where that is the
textbook, what is needed of it, and all that was found, are asked as well.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from excite_cli.diagnosis.comparison import Comparison
from excite_cli.diagnosis.judgement import Judgement
from excite_cli.diagnosis.records import AS_GOOD
from excite_cli.diagnosis.search import weakest_apart
from excite_cli.diagnosis.textbook import everyday, textbook
from excite_cli.diagnosis.tracing import Traced

# Of the torque's RMS: what is smaller needs no name. Two standard deviations of what filters and
# differentiated positions leave (`final_fit`, 0.4 %): beside friction that grows with load, dry
# friction of 0.3 % that nobody had put in predicted better, and viscous friction of 0.5 % on an
# axis that stands upright.
_SMALLEST = 8e-3


def comparison_of(traced: Traced) -> Comparison:
    """Of models of what was found and of the textbook's effects."""
    members = {*traced.chosen, *everyday(traced.candidates)}
    return Comparison(traced.data, traced.candidates, members, traced.levels, traced.noise)


def sufficient(traced: Traced, models: Comparison) -> list[int]:
    """The candidates found that are needed, or the textbook's."""
    plain = textbook(traced.candidates, models)
    found = list(traced.chosen)
    kept = _needed(traced.judge, found, models)
    if _smallest(traced, [kept, plain], models) == kept:
        return kept
    return _smallest(traced, [kept, _needed(traced.judge, plain, models), found, plain], models)


def _smallest(traced: Traced, sets: Iterable[list[int]], models: Comparison) -> list[int]:
    """The smallest, unless a larger one predicts new recordings better."""
    best, *larger = sorted(sets, key=lambda some: _width(traced, some))
    for some in larger:
        gained = models.as_new(best, some)
        if gained.better and gained.of_error > np.log(AS_GOOD):
            best = some
    return best


def _width(traced: Traced, some: Sequence[int]) -> int:
    """Number of parameters."""
    return sum(traced.candidates[i].width for i in some)


def _needed(judge: Judgement, some: Sequence[int], models: Comparison) -> list[int]:
    """Those of some candidates that are needed beside each other."""
    chosen = list(some)
    while True:
        cannot = [i for i in chosen if not _can_be(judge, chosen, [i])]
        idle = _idle(judge, chosen, cannot, models)
        leaving, open_ = list[int](), dict(idle)
        while open_ and not leaving:
            for i in weakest_apart(open_, lambda i: judge.candidates[i].rows):
                rest = [k for k in chosen if k != i and k not in leaving]
                if i in cannot or _can_be(judge, rest, [k for k in rest if k not in idle]):
                    leaving.append(i)
                del open_[i]
        if not leaving:
            return chosen
        chosen = [k for k in chosen if k not in leaving]


def _can_be(judge: Judgement, chosen: Sequence[int], which: Sequence[int]) -> bool:
    """Whether the sizes of some are possible in the model of the chosen ones."""
    return judge.allowed(judge.plain.solve(chosen), chosen, which)


def _idle(
    judge: Judgement, chosen: Sequence[int], cannot: Sequence[int], models: Comparison
) -> dict[int, float]:
    """How clearly each is needed of those that may leave."""
    gains, found = models.needed(chosen), {}
    for i in chosen:
        rest = [k for k in chosen if k != i]
        if judge.told_by_weight(i, rest):
            continue
        # What refines it would take its place, with a wrong size: both are in, or neither.
        alone = judge.without(i, chosen)
        gain = gains[i] if alone == rest else models.difference(alone, chosen)
        small = judge.size(rest, [i], judge.white.rows_of[i]) < _SMALLEST
        if small or not gain.better or i in cannot:
            found[i] = gain.clearness
    return found
