"""What was found, or the textbook's model: the answer.

What the search named leaves, where it acts on several joints and is missed on one of them at most,
unless the model with all of that predicts new recordings better (`comparison`). Where one of the
kinds that make up an effect predicts as well, it takes its place. Of this, with the friction and
rotors of the textbook beside it, and the textbook's model the one with fewer parameters is the
answer, unless the other predicts better: by 2 % of the error, what was found; surely, the
textbook's model, which claims nothing.

What single runs carry describes these recordings, and no new one is the better predicted for it
(pushes, and a load of two runs in three, were left out of the answer so). It stays if seconds
left out of the same recordings miss it, and is then beside both models that are compared.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.diagnosis import rules
from excite_cli.diagnosis.comparison import ModelComparison
from excite_cli.diagnosis.extrapolation import torque_seen
from excite_cli.diagnosis.search import weakest_apart
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.textbook import everyday

# What every robot has stays in the model, unless the model says the same without it.
#
# Friction and the inertia of rotors are in every robot. That data left out do not miss one of them
# says that these data cannot tell it: of a joint that crept a rotor of any size is next to nothing,
# and much along another motion. So all of them are fitted beside what was found. Each leaves only
# where the model without it, all others fitted anew, says the same along a usual motion:
#
#     u = max_j RMS_t(c_jᵀ d) (|θ| + 2 s) / RMS τ_j,    d = P e / (eᵀ P e),
#
# with P the covariance of all parameters, θ and s = √(eᵀ P e) size and deviation of this one (the
# unit vector e), and c_j the columns of joint j, is below a fiftieth and, of what is surely there,
# below what needs a name at all. Not so defects of the measurement, of which many robots have none:
# with offsets a UR10 of the battery was left with 14.8 % for 7.4.

_ITS_OWN = 1e-6  # of a column's energy: what the model leaves of less is rounding
_DEVIATIONS = 2.0


def with_everyday(traced: SearchResult, chosen: Sequence[int]) -> list[int]:
    """The chosen ones with the friction and rotors of the textbook, those that do not matter away.

    None that the chosen ones exclude. What the data do not tell from them, offsets as well, is
    beside them where it is in the textbook's model: together they have what that gives them.
    """
    judge, candidates = traced.judge, traced.candidates
    taken = {candidates[i].place for i in chosen}
    taken |= {place for i in chosen for place in judge.excluded(i)}
    schur, white = judge.white.schur(chosen), judge.white
    found = list(chosen)
    for i in everyday(candidates):
        (at,) = white.blocks[i]
        own = schur.diagonal[at - white.fixed] > _ITS_OWN * white.total[at, at]
        effect = candidates[i].effect
        wanted = not effect.data_defect if own else i in traced.plain
        if wanted and effect.place not in taken:
            found.append(i)
    return those_that_matter(traced, found)


def those_that_matter(traced: SearchResult, chosen: Sequence[int]) -> list[int]:
    """Without those of the textbook's that surely do not matter, or whose size cannot be.

    An offset may have any size: of what is missing beside it, it makes up the mean.
    """
    judge, found = traced.judge, list(chosen)
    elsewhere = _Elsewhere(traced, found)
    common = set(everyday(traced.candidates))

    def least(i: int) -> float:
        there = judge.p_value(i, judge.white.gain_of(i, found)) <= judge.rules.significance
        return rules.SMALLEST if there else rules.MATTERS

    def any_size(i: int) -> bool:
        return traced.candidates[i].effect.data_defect

    while True:
        theta, shares = traced.fitted(found), elsewhere.shares(found)
        leaving = {
            i: shares[i]
            for i in common.intersection(found)
            if not (shares[i] > least(i) and (any_size(i) or judge.allowed(theta, found, [i])))
        }
        if not leaving:
            return found
        gone = weakest_apart(leaving, lambda i: traced.candidates[i].rows)
        found = [i for i in found if i not in gone]


class _Elsewhere:
    """What the model says along the usual motion: mean squares (n, K, K)."""

    def __init__(self, traced: SearchResult, members: Sequence[int]) -> None:
        self._traced, white = traced, traced.judge.white
        effects = [traced.candidates[i].effect for i in members]
        columns = white.columns(members)
        self._usual = traced.usual.gram(traced.model, effects)
        self._place = {int(column): k for k, column in enumerate(columns)}
        torque = torque_seen(traced.data)
        self._torque = np.where(torque > 0.0, torque, np.inf)  # nothing is known of other joints

    def shares(self, chosen: Sequence[int]) -> dict[int, float]:
        """u of each of the chosen: how much the model may say otherwise without it."""
        traced, white = self._traced, self._traced.judge.white
        theta = traced.judge.plain.solve(chosen)
        covariance = traced.inflation * white.covariance(chosen)
        at: Indices = np.array([self._place[int(c)] for c in white.columns(chosen)])
        usual = self._usual[:, at[:, None], at]
        start, found = white.fixed, {}
        for i in chosen:
            own = slice(start, start + traced.candidates[i].width)
            start = own.stop
            there = _otherwise(usual, covariance[:, own], covariance[own, own], theta[own])
            found[i] = float((there / self._torque).max())
        return found


def _otherwise(gram: Array, across: Array, own: Array, size: Array) -> Array:
    """RMS (n,) [N·m] of what the model may say otherwise without parameters of this `size` (w,).

    `across` (k, w) and `own` (w, w) are their parts of the covariance.
    """
    steps = np.linalg.solve(own.T, across.T).T
    squares = steps.T @ gram @ steps
    mean = np.sqrt(np.maximum(np.einsum("p,jpq,q->j", size, squares, size), 0.0))
    spread = np.sqrt(np.maximum(np.einsum("jpq,qp->j", squares, own), 0.0))
    return np.asarray(mean + _DEVIATIONS * spread)


def comparison_of(traced: SearchResult) -> ModelComparison:
    """Of models of what was found and of the textbook's effects."""
    return ModelComparison(traced.data, traced.candidates, traced.members, traced.levels)


def sufficient(traced: SearchResult, models: ModelComparison) -> list[int]:
    """The candidates found, with what every robot has, or the textbook's."""
    chosen = _by_parts(traced, models)
    several = _seen_on_several(traced, models, chosen)
    single = _of_single_runs(traced, models, several)
    plain = [*traced.plain, *single]
    kept = [i for i in several if i in single or not traced.candidates[i].effect.runs]
    every, found = (with_everyday(traced, some) for some in (chosen, kept))
    if models.difference(found, every).better:
        found = every
    best, larger = sorted(
        (plain, found), key=lambda some: sum(traced.candidates[i].width for i in some)
    )
    gained = models.difference(best, larger)
    least = 0.0 if larger is plain else np.log(rules.AS_GOOD)
    if gained.better and gained.of_error > least:
        best = larger
    return those_that_matter(traced, best)


def _seen_on_several(
    traced: SearchResult, models: ModelComparison, chosen: Sequence[int]
) -> list[int]:
    """What was found, but for what acts on several joints and is missed on one of them at most."""
    judge, found = traced.judge, list(chosen)
    while True:
        doubtful = {
            i: judge.white.gain_of(i, found).chi2
            for i in found
            if len(rows := traced.candidates[i].rows) > 1
            and not judge.white.is_brief([i])
            and not models.missed(found, judge.without(i, found), rows)
        }
        if not doubtful:
            return found
        found = judge.without(min(doubtful, key=doubtful.__getitem__), found)


def _by_parts(traced: SearchResult, models: ModelComparison) -> list[int]:
    """What was found, with one part in place of an effect where that predicts as well.

    Losses of a gear that are the same both ways are friction by load.
    """
    judge, found = traced.judge, list(traced.chosen)
    for i in traced.chosen:
        for k in traced.parts_of(i):
            fewer = [k if each == i else each for each in found]
            if k in found or not judge.allowed(judge.plain.solve(fewer), fewer, [k]):
                continue
            if models.difference(fewer, found).of_error <= np.log(rules.AS_GOOD):
                found = fewer
                break
    return found


def _of_single_runs(
    traced: SearchResult, models: ModelComparison, found: Sequence[int]
) -> list[int]:
    """What single runs carry, of what was found: seconds left out of the same recordings miss it.

    Or it is too brief for them to know.
    """
    judge = traced.judge
    return [
        i
        for i in found
        if traced.candidates[i].effect.runs
        and (
            judge.white.is_brief([i])
            or models.missed(found, judge.without(i, found), traced.candidates[i].rows)
        )
    ]
