"""Signs and sizes that physics allows: what an effect cannot be, however well it fits."""

from collections.abc import Callable, Sequence

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.effects.seen import Seen
from excite_cli.robot.model import Array

Spread = Callable[[Sequence[int]], Array]


class PossibleSizes:
    """Judges fitted sizes of effects.

    `spread(chosen)` is the covariance of the parameters of a model with these candidates; it is
    asked for only where a value is impossible: what is so by the error of the fit only is allowed
    (`Effect.why_impossible`). `early_pass`: of a diagnosis, which does not know the
    torque well yet.
    """

    def __init__(
        self, candidates: Sequence[Candidate], early_pass: bool, spread: Spread, seen: Seen
    ) -> None:
        self._candidates, self._early, self._seen = candidates, early_pass, seen
        self._spread = spread

    def __call__(self, parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        """Whether all that is `added` can be so; `parameters` end with those of the `chosen`."""
        return not self.why_not(parameters, chosen, added)

    def why_not(self, parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> str:
        """Why something `added` cannot be so; empty if all can."""
        start = len(parameters) - sum(self._candidates[i].width for i in chosen)
        for i in chosen:
            own = slice(start, start + self._candidates[i].width)
            start = own.stop
            if i not in added:
                continue
            effect, values = self._candidates[i].effect, parameters[own]
            reason = effect.absurd(values, self._seen)
            if not reason and not effect.possible(values, self._early):
                covariance = self._spread(chosen)[own, own]
                reason = effect.why_impossible(values, covariance, self._early)
            if reason:
                return reason
        return ""


def spread_of(covariance: Callable[[Sequence[int]], Array], inflation: float) -> Spread:
    """`inflation` times `covariance`; the last one is kept, since it is asked for repeatedly."""
    last: dict[tuple[int, ...], Array] = {}

    def spread(chosen: Sequence[int]) -> Array:
        key = tuple(chosen)
        if key not in last:
            last.clear()
            last[key] = inflation * covariance(key)
        return last[key]

    return spread
