"""Limits of the moved joints; those of joints that follow others narrow their driver's.

Where joint f follows d, q_f = m q_d + c, the limits of f hold if q_d stays between (l_f − c)/m and
(u_f − c)/m, and speed, acceleration and jerk of d below those of f over |m|. Torque is that of the
driver's row, which carries all that follows it.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from excite_cli.arrays import Array
from excite_cli.config.robot_spec import LIMIT_PRESETS, JointLimits, RobotSpec
from excite_cli.errors import ConfigError, RobotError
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.loops import Mimic

# Position limits as the file of a robot writes them, whatever its format.
#
# Two equal limits hold a joint there. Reversed ones are taken the other way round: between them
# lies what the robot can do. Only 0 and 0, which is also what a file without limits gives, is no
# limit.

UNBOUNDED = 1e9  # rad or m; from here on a figure is no limit
_KINDS = ("revolute", "prismatic")


def ordered_limits(path: Path, root: ElementTree.Element) -> dict[str, str]:
    """Put the limits of a URDF's tree in order; what was done, in words, by the joint's name.

    Raises
    ------
    RobotError
        The limits of a joint are both beyond all that a robot can reach.
    """
    said = {}
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if joint.get("type") not in _KINDS or limit is None:
            continue
        name = joint.get("name", "")
        texts = limit.get("lower", "0"), limit.get("upper", "0")
        lower, upper = map(float, texts)
        if lower > upper:
            limit.set("lower", texts[1])
            limit.set("upper", texts[0])
            said[name] = (
                f"the position limits of {name} are reversed in {path.name}, {lower:g} to "
                f"{upper:g}: they are taken as {upper:g} to {lower:g}"
            )
        if min(lower, upper) >= UNBOUNDED or max(lower, upper) <= -UNBOUNDED:
            raise RobotError(
                f"{path}: joint '{name}' has the position limits {lower:g} and {upper:g}, which no "
                "robot can reach. Positions are in rad (m for prismatic joints)."
            )
    return said


# Where a robot has no bound of its own, samples are drawn from these.
_TURN = np.pi


@dataclass(frozen=True)
class Limits:
    """Bounds of the moved joints, each (n,); infinite where there is none.

    `curves` (n,): torque by speed, a constant for most.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    curves: tuple[EffortCurve, ...]

    @property
    def effort(self) -> Array:
        """Torque (n,) [N·m or N] at no speed."""
        return np.array([curve.efforts[0] for curve in self.curves])

    def ranges(self) -> tuple[Array, Array]:
        """Finite positions (n,) to draw between: a turn where there is no bound, or only one."""
        low, high = np.isfinite(self.lower), np.isfinite(self.upper)
        lower = np.where(low, self.lower, np.where(high, self.upper - 2 * _TURN, -_TURN))
        return lower, np.where(high, self.upper, np.where(low, self.lower + 2 * _TURN, _TURN))


@dataclass(frozen=True)
class JointRange:
    """Bounds of one joint; infinite where there is none.

    Without `known` nothing gives it limits of position: a file of a robot that has none says 0, 0.
    It is `held` where its limits, or those of a joint that follows it, are equal.
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float = np.inf
    jerk: float = np.inf
    effort: EffortCurve = field(default_factory=lambda: EffortCurve.constant(np.inf))
    known: bool = True
    held: bool = False

    @classmethod
    def written(
        cls, lower: float, upper: float, velocity: float, effort: float = np.inf
    ) -> "JointRange":
        """As the file of a robot gives it, its limits in order."""
        known = not lower == upper == 0.0
        held = known and lower == upper
        curve = EffortCurve.constant(effort)
        return cls(lower, upper, velocity, effort=curve, known=known, held=held)

    def given(self, own: JointLimits | None) -> "JointRange":
        """With those that the config gives in place of the URDF's."""
        if own is None:
            return self
        lower, upper = own.position or (self.lower, self.upper)
        effort = self.effort
        if own.effort is not None:
            effort = EffortCurve.constant(own.effort)
        elif own.effort_by_speed is not None:
            effort = EffortCurve(*np.array(own.effort_by_speed).T)
        return JointRange(
            lower,
            upper,
            own.velocity or self.velocity,
            own.acceleration or self.acceleration,
            own.jerk or self.jerk,
            effort,
            self.known or own.position is not None,
            self.held and own.position is None,
        )

    def keeping(self, follower: "JointRange", mimic: Mimic) -> "JointRange":
        """Narrowed so that a joint that follows keeps its limits too, as far as it has any."""
        m = mimic.multiplier
        if m == 0.0:
            return self
        lower, upper = self.lower, self.upper
        if self.known and follower.known:
            ends = [(end - mimic.offset) / m for end in (follower.lower, follower.upper)]
            lower, upper = max(lower, min(ends)), min(upper, max(ends))
        return replace(
            self,
            lower=lower,
            upper=upper,
            velocity=min(self.velocity, follower.velocity / abs(m)),
            acceleration=min(self.acceleration, follower.acceleration / abs(m)),
            jerk=min(self.jerk, follower.jerk / abs(m)),
            held=(self.held or follower.held) and lower == upper,
        )


def limits_of(names: tuple[str, ...], ranges: Mapping[str, JointRange]) -> Limits:
    """Of these joints, in their order."""
    found = [ranges[name] for name in names]
    columns = ("lower", "upper", "velocity", "acceleration", "jerk")
    bounds = {key: np.array([getattr(one, key) for one in found]) for key in columns}
    return Limits(**bounds, curves=tuple(one.effort for one in found))


def given_limits(spec: RobotSpec, names: Sequence[str]) -> dict[str, JointLimits]:
    """What the config gives for joints among `names`, over those of its preset.

    Raises
    ------
    ConfigError
        The robot lacks joints of the robot that the preset is of.
    """
    if spec.limits_preset is None:
        return spec.limits
    preset, found = LIMIT_PRESETS[spec.limits_preset], dict(spec.limits)
    if missing := preset.missing(names):
        raise ConfigError(
            f"robot.limits_preset: {preset.title} has {len(preset.joints)} joints, but no joint of "
            f"this robot is called as its joint {', '.join(missing)} is. Joints: "
            f"{', '.join(names)}. Give limits under robot.limits.<joint>."
        )
    for name, values in preset.of_joints(names):
        own = spec.limits.get(name, JointLimits()).model_dump(exclude_none=True)
        dropped = {"effort"} if "effort_by_speed" in own else set()
        both = {key: value for key, value in values.items() if key not in dropped} | own
        found[name] = JointLimits.model_validate(both)
    return found


def check_range(name: str, own: JointRange, kept: JointRange, followers: list[str]) -> None:
    """See that a joint that moves has a range: its `own`, and the one `kept` for its followers.

    Raises
    ------
    ConfigError
        It has no limits or equal ones, or those of the joints that follow it leave it no range.
    """
    if not own.lower < own.upper:
        what = (
            f"is held at {own.lower:g} by equal position limits"
            if own.held
            else "has no position limits (0 to 0)"
        )
        raise ConfigError(
            f"robot: joint '{name}' {what} in the robot's file. To move it, give it some under "
            f"robot.limits.{name}.position; else leave it out of robot.joints."
        )
    if not kept.lower < kept.upper:
        raise ConfigError(
            f"robot: joint '{name}' may stand in [{own.lower:g}, {own.upper:g}], but the joints "
            f"that mimic it ({', '.join(followers)}) have position limits that leave it no range. "
            "Give theirs under robot.limits.<joint>.position, or leave "
            f"'{name}' out of robot.joints."
        )
