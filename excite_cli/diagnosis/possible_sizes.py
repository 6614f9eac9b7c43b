"""Signs and sizes that physics allows: what an effect cannot be, however well it fits."""

from collections.abc import Callable, Sequence

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.extrapolation import Reach
from excite_cli.effects.base import Effect
from excite_cli.effects.judgement import Seen
from excite_cli.identification.regression import places_of
from excite_cli.robot.model import Array

_ERRORS = 2.0  # deviations by which what is there may be less than what is taken
Spread = Callable[[Sequence[int], Array], Array]


class PossibleSizes:
    """Judges fitted sizes of effects.

    `spread(chosen, directions)` is the covariance (d, d) of d sums (k, d) of the k parameters of
    a model with these candidates; it is asked for only where a value is impossible: what is so by
    the error of the fit only is allowed (`Effect.why_impossible`). `declared`: effects whose
    parameters come before those of the chosen.
    """

    def __init__(
        self,
        candidates: Sequence[Candidate],
        spread: Spread,
        seen: Seen,
        declared: Sequence[Effect] = (),
        reach: Reach | None = None,
    ) -> None:
        self._candidates, self._seen, self._reach = candidates, seen, reach
        self._spread, self._declared = spread, declared

    def __call__(self, parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether all that is `added` can be so; `parameters` end with those of the `chosen`."""
        return not self.why_not(parameters, chosen, added)

    def why_not(self, parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> str:
        """Why something `added` cannot be so; empty if all can."""
        effects = [self._candidates[i].effect for i in chosen]
        for i, effect, own in zip(
            chosen, effects, places_of(effects, len(parameters)), strict=True
        ):
            if i not in added:
                continue
            values = parameters[own]
            reason = effect.absurd(values, self._seen)
            if not reason and not effect.possible(values):
                if len(values) == 1 and type(effect).nearest is Effect.nearest:
                    reason = effect.why_not(values)  # the nearest is nothing, whatever the error
                else:
                    directions = np.eye(len(parameters))[:, own]
                    reason = effect.why_impossible(values, self._spread(chosen, directions))
            if not reason and self._reach is not None:
                reason = self._reach.why_not(i, values)
            if effect.varied and not reason:
                reason = self._too_much_taken(effect, own, parameters, chosen)
            if reason:
                return reason
        return ""

    def _too_much_taken(
        self, effect: Effect, own: slice, parameters: Array, chosen: Sequence[int]
    ) -> str:
        """Why it takes more, beyond the error of the fit, than a joint has of what it varies."""
        taken, slope = effect.taken(parameters[own])
        for joint in effect.joints:
            slopes = np.zeros(len(parameters))
            slopes[own] = -slope
            slopes[self._at(effect.varied, (joint,), len(parameters), chosen)] = 1.0
            there = float(slopes @ parameters) + float(slope @ parameters[own])
            if taken <= there:
                continue
            variance = float(self._spread(chosen, slopes[:, None])[0, 0])
            if there <= 0.0 or taken - there > _ERRORS * np.sqrt(max(variance, 0.0)):
                return f"{effect.kind} of {taken:.3g} exceeds the {effect.varied} there"
        return ""

    def _at(
        self, kind: str, joints: tuple[int, ...], count: int, chosen: Sequence[int]
    ) -> list[int]:
        """Parameters, of `count`, that are the size of a kind on these joints in all runs."""
        effects = [*self._declared, *(self._candidates[i].effect for i in chosen)]
        return [
            own.start
            for each, own in zip(effects, places_of(effects, count), strict=True)
            if each.kind == kind and each.joints == joints and not each.runs
        ]
