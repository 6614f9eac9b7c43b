"""At what pace the motions of a round are played, and which effects a motion looks for."""

from collections.abc import Sequence

from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.robot.model import Robot

_FASTER = 2.0  # from round to round


def pace_of(number: int, from_speed: float) -> float:
    """Share of the motions' own pace in round `number`, the first being 1: twice as fast each."""
    return min(1.0, from_speed * _FASTER ** (number - 1))


def looked_for(robot: Robot, known: Sequence[Effect]) -> tuple[Effect, ...]:
    """Effects that a motion should make visible which nobody has found yet.

    Of every joint, each kind whose torque is a function of the joint's own state (position, speed,
    load), in its usual shape, where `known` has none of that kind. What a log itself may have got
    wrong, or what changes over the days, shows in any motion or in none.
    """
    there = {(each.kind, each.joints) for each in known}
    return tuple(
        kind(joints, dict(kind.defaults))
        for name, kind in catalogue().items()
        if kind.scope == "joint"
        and kind.excitable
        and kind.function_of
        and not (kind.over_time or kind.data_defect or kind.of_campaign or kind.same_as)
        for joints in kind.places(robot)
        if (name, joints) not in there
    )
