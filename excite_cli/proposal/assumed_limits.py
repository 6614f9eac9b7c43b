"""Limits and pace of a plan, where the URDF has no limits, or placeholders.

A figure is taken for a placeholder where no real joint has it: speeds of 0 or beyond 60 rad/s,
torques of 0 or from 1000 N·m on, ranges beyond two turns either way. What is assumed lies within
the range that the URDF gives, if it gives one: 0 to 0 is none.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.robot.urdf_joints import UrdfJoint
from excite_cli.trajectory.base import harmonics_for

_FASTEST, _FASTEST_SLIDE = 60.0, 10.0
_STRONGEST, _STRONGEST_SLIDE = 1000.0, 20_000.0
_TWO_TURNS = 4 * math.pi + 0.1
_LONGEST = 10.0
ASSUMED_TURN, ASSUMED_SLIDE = 3.1, 0.1
ASSUMED_SPEED, ASSUMED_SLIDE_SPEED = 3.1, 0.2
# A joint reaches its top speed in this time, and accelerates no harder than this.
_TO_TOP_SPEED = 0.2
MOST_ACCELERATION, _MOST_SLIDE = 10.0, 2.0


@dataclass(frozen=True)
class JointPlan:
    """What one joint is to keep, and what of it was assumed.

    lower, upper [rad or m], velocity, acceleration, effort (nan: not bounded) with a sentence for
    each figure that is not the URDF's, by the name of the key in `robot.limits`.
    """

    name: str
    sliding: bool
    lower: float
    upper: float
    velocity: float
    acceleration: float
    effort: float
    notes: dict[str, str]

    @property
    def width(self) -> float:
        """Range [rad or m]."""
        return self.upper - self.lower


def plan_limits(joints: Iterable[UrdfJoint]) -> tuple[JointPlan, ...]:
    """Limits for every joint, those of the URDF where they are sensible."""
    joints = tuple(joints)
    return tuple(_plan(joint, _twin(joint, joints)) for joint in joints)


def _plan(joint: UrdfJoint, twin: UrdfJoint | None) -> JointPlan:
    notes: dict[str, str] = {}
    unit = "m" if joint.sliding else "rad"
    lower, upper = _position(joint, unit, notes)
    velocity = joint.velocity
    if not _speed_is_real(joint):
        given = _as_given(velocity, f"{unit}/s")
        if twin is not None and _speed_is_real(twin):
            velocity = twin.velocity
            notes["velocity"] = f"the URDF gives {given}; {velocity:g} {unit}/s as {twin.name}"
        else:
            velocity = ASSUMED_SLIDE_SPEED if joint.sliding else ASSUMED_SPEED
            notes["velocity"] = f"the URDF gives {given}; {velocity:g} {unit}/s assumed"
    most = _MOST_SLIDE if joint.sliding else MOST_ACCELERATION
    effort = joint.effort
    if not _effort_is_real(joint):
        force = "N" if joint.sliding else "N·m"
        given = _as_given(effort, force)
        if twin is not None and _effort_is_real(twin):
            effort = twin.effort
            notes["effort"] = f"the URDF gives {given}; {effort:g} {force} as {twin.name}"
        else:
            effort = math.nan
    return JointPlan(
        joint.name,
        joint.sliding,
        lower,
        upper,
        velocity,
        min(most, rounded(velocity / _TO_TOP_SPEED)),
        effort,
        notes,
    )


def _position(joint: UrdfJoint, unit: str, notes: dict[str, str]) -> tuple[float, float]:
    lower, upper = joint.lower, joint.upper
    longest = _LONGEST if joint.sliding else _TWO_TURNS
    if joint.known and upper - lower <= longest:
        return lower, upper
    reach = ASSUMED_SLIDE if joint.sliding else ASSUMED_TURN
    if not joint.known:
        given, lower, upper = "no limits (0 to 0)", -math.inf, math.inf
    elif not (math.isfinite(lower) or math.isfinite(upper)):
        given = "no bounds"
    else:
        given = f"[{lower:g}, {upper:g}] {unit}"
    low, high = _within(lower, upper, reach)
    assumed = f"±{reach:g}" if low == -high else f"{low:g} to {high:g}"
    notes["position"] = f"the URDF gives {given}; {assumed} {unit} assumed"
    return low, high


def _within(lower: float, upper: float, reach: float) -> tuple[float, float]:
    """What of `reach` either way lies within the range; where 0 does not, `reach` from an end."""
    if lower < 0.0 < upper:
        return max(lower, -reach), min(upper, reach)
    return (lower, lower + reach) if lower >= 0.0 else (upper - reach, upper)


def _speed_is_real(joint: UrdfJoint) -> bool:
    return 1e-3 < joint.velocity <= (_FASTEST_SLIDE if joint.sliding else _FASTEST)


def _effort_is_real(joint: UrdfJoint) -> bool:
    return 1e-3 < joint.effort < (_STRONGEST_SLIDE if joint.sliding else _STRONGEST)


def _twin(joint: UrdfJoint, joints: tuple[UrdfJoint, ...]) -> UrdfJoint | None:
    """The same joint of the other side, if the names tell."""
    names = {other.name: other for other in joints}
    for one, other in (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT")):
        for a, b in ((one, other), (other, one)):
            if a in joint.name:
                return names.get(joint.name.replace(a, b))
    return None


def _as_given(value: float, unit: str) -> str:
    return "none" if math.isnan(value) else f"{value:g} {unit}"


def rounded(value: float) -> float:
    """`value` to two significant digits."""
    return float(f"{value:.2g}")


# How long a motion should be, and how many harmonics it should have.

_SHORTEST_MOTION, _LONGEST_MOTION = 10.0, 20.0
# How far the slowest joint should come either way: this share of half of its range, at most.
_SHARE, _FAR, _FAR_SLIDE = 0.5, 0.8, 0.1
# Forty instants to a period of the highest harmonic; what lies between them is proved.
_INSTANTS = 200


@dataclass(frozen=True)
class Pace:
    """Seconds of one motion, harmonics, instants of the constraint grid.

    slowest: the joint that asks for so long a motion; None where the usual length is enough.
    """

    duration: float
    harmonics: int
    constraint_samples: int
    slowest: str | None

    @property
    def base_frequency(self) -> float:
        """ω [rad/s]."""
        return 2 * math.pi / self.duration


def choose_pace(joints: Sequence[JointPlan]) -> Pace:
    """The pace that lets the slowest joint use half of its range with the first harmonic."""
    needed = []
    for joint in joints:
        far = min(_SHARE * joint.width / 2, _FAR_SLIDE if joint.sliding else _FAR)
        needed.append(2 * math.pi * far / joint.velocity)
    slowest = int(np.argmax(needed))
    duration = float(math.ceil(min(max(needed[slowest], _SHORTEST_MOTION), _LONGEST_MOTION)))
    usual = needed[slowest] <= _SHORTEST_MOTION
    harmonics = harmonics_for(duration, np.array([joint.acceleration for joint in joints]))
    return Pace(duration, harmonics, _INSTANTS, None if usual else joints[slowest].name)
