"""Signs and sizes that physics allows: what an effect cannot be, however well it fits."""

from collections.abc import Callable, Sequence

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.effects.base import Effect
from excite_cli.robot.model import Array

Allowed = Callable[[Array, Sequence[int], Sequence[int]], bool]

# Sizes that do not depend on the robot's have limits: no encoder is 12° off.
_BOUNDED = ("encoder_offset", "torque_delay", "base_tilt", "torque_gain")
_SHORTEST_DELAY = 1.5e-3  # s, of one joint alone: less is friction that lags a little
# Clipping takes away all that is above the level, and play all of the load: their parameter is one
# by nature, and believed within this range.
_WHOLE, _RANGE = ("torque_saturation", "backlash"), (0.6, 1.5)
# At first the torque above the level is itself fitted to cut data, and too small.
_EARLY_RANGE = (0.18, 6.0)


def possible_sizes(candidates: Sequence[Candidate], early_pass: bool) -> Allowed:
    """The function allowed(parameters, chosen, added): False if an added one cannot be so.

    `parameters` end with those of the `chosen` candidates, in their order.
    """
    whole = _EARLY_RANGE if early_pass else _RANGE

    def allowed(parameters: Array, chosen: Sequence[int], added: Sequence[int]) -> bool:
        start = len(parameters) - sum(candidates[i].width for i in chosen)
        for i in chosen:
            width = candidates[i].width
            own = parameters[start : start + width]
            if i in added and not _possible(candidates[i].effect, own, whole):
                return False
            start += width
        return True

    return allowed


def _possible(effect: Effect, values: Array, whole: tuple[float, float]) -> bool:
    alone = len(effect.joints) == 1
    for value, parameter in zip(values, effect.parameters, strict=True):
        if parameter.nonnegative and value < 0:
            return False
        if effect.kind in _BOUNDED and abs(value) > parameter.high:
            return False
        if effect.kind == "torque_delay" and alone and value < _SHORTEST_DELAY:
            return False
        if effect.kind in _WHOLE and not whole[0] <= value <= whole[1]:
            return False
    return True
