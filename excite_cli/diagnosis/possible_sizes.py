"""Signs and sizes that physics allows: what an effect cannot be, however well it fits."""

from collections.abc import Callable, Sequence

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.robot.model import Array

Allowed = Callable[[Array, Sequence[int], Sequence[int]], bool]


def possible_sizes(candidates: Sequence[Candidate], early_pass: bool) -> Allowed:
    """The function allowed(parameters, chosen, added): False if an added one cannot be so.

    `parameters` end with those of the `chosen` candidates, in their order.
    """

    def allowed(parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        start = len(parameters) - sum(candidates[i].width for i in chosen)
        for i in chosen:
            width = candidates[i].width
            own = parameters[start : start + width]
            if i in added and not candidates[i].effect.possible(own, early_pass):
                return False
            start += width
        return True

    return allowed
