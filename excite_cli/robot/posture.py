"""Where every joint stands by the config, and how joints follow others."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.limits import JointRange, Limits
from excite_cli.robot.loops import Mimic

_AS_TOLD = 1e-3  # rad or m by which a posture may differ from what a joint follows


def posture_of(
    spec: RobotSpec,
    names: list[str],
    chosen: list[str],
    ranges: dict[str, JointRange],
    mimicking: dict[str, Mimic],
) -> dict[str, float]:
    """Positions of all joints `names` [rad or m].

    Raises
    ------
    ConfigError
        The config names an unknown joint, or a position that a joint cannot have.
    """
    for joint in spec.posture:
        require_known(joint, names, "robot.posture")
    for joint in spec.limits:
        require_known(joint, names, "robot.limits")
    posture = {}
    for name in names:
        if name in mimicking:
            continue
        own_range = ranges[name]
        lower, upper = own_range.lower, own_range.upper
        if name in spec.posture:
            value = float(spec.posture[name])
            if own_range.held:
                value = _held(name, value, lower)
            elif not lower <= value <= upper and (lower < upper or name in chosen):
                raise ConfigError(
                    f"robot.posture.{name}: {value:g} is outside its limits "
                    f"[{lower:g}, {upper:g}]. Give a value between them{_in_degrees(value)}."
                )
        else:
            value = 0.0 if lower <= 0.0 <= upper else _inside(lower, upper)
        posture[name] = value
    for name in names:
        if name in mimicking:
            own = mimicking[name]
            posture[name] = own.position(posture.get(own.driver, 0.0))  # 0: the driver is fixed
            given = spec.posture.get(name, posture[name])
            if abs(given - posture[name]) > _AS_TOLD:
                raise ConfigError(
                    f"robot.posture.{name}: {given:g} is not where it stands, {posture[name]:.6g}: "
                    f"it mimics '{own.driver}'. Leave it out, and give robot.posture."
                    f"{own.driver}."
                )
    return posture


def _held(name: str, given: float, held: float) -> float:
    """Where equal limits hold a joint, once the config says nothing else."""
    if abs(given - held) > _AS_TOLD:
        raise ConfigError(
            f"robot.posture.{name}: {given:g} is not where it stands, {held:g}: its position "
            f"limits are equal. Leave it out, or give robot.limits.{name}.position."
        )
    return held


def _inside(lower: float, upper: float) -> float:
    """The middle of the range, or a little off its only bound."""
    if np.isfinite(lower) and np.isfinite(upper):
        return (lower + upper) / 2
    return lower + 0.5 if np.isfinite(lower) else upper - 0.5


def _in_degrees(value: float) -> str:
    """A hint for those who wrote degrees."""
    if abs(value) <= 2 * np.pi:
        return ""
    return f"; angles are in radians, {value:g}° is {np.radians(value):.4g} rad"


def require_known(joint: str, names: list[str], where: str) -> None:
    """Raise ConfigError unless the robot has the joint that `where` names."""
    if joint not in names:
        raise ConfigError(
            f"{where}: the robot has no joint '{joint}'.{nearest(joint, names)} "
            f"Its joints: {', '.join(names)}."
        )


# Joints that follow others: the motion of all joints from that of those that move on their own.
#
#     q_all = C q + c,    v_all = C v,    a_all = C a,    τ = Cᵀ τ_all
#
# by virtual power. C has one entry a row, the multiplier of the joint that is followed, so
# everything that is known of all joints (regressor, gradients, enclosures over intervals) is
# known exactly of those that move on their own.


@dataclass(frozen=True)
class Coupling:
    """All joints that move, m of them, by the n that move on their own.

    `joint_names` (m,) in the order of the model; `driver` (m,) the joint among the n that each
    follows, of those that move on their own themselves; `multiplier` and `offset` (m,); `limits`
    of each joint by itself.
    """

    joint_names: tuple[str, ...]
    driver: Indices
    multiplier: Array
    offset: Array
    limits: Limits

    @cached_property
    def matrix(self) -> Array:
        """C (m, n)."""
        found = np.zeros((len(self.driver), int(self.driver.max()) + 1))
        found[np.arange(len(self.driver)), self.driver] = self.multiplier
        return found

    def positions(self, q: Array) -> Array:
        """Of all joints (..., m) from q (..., n)."""
        return np.asarray(q[..., self.driver] * self.multiplier + self.offset)

    def rates(self, v: Array) -> Array:
        """Speeds or accelerations of all joints (..., m) from those of q (..., n)."""
        return np.asarray(v[..., self.driver] * self.multiplier)

    def gathered(self, x: Array) -> Array:
        """Torques, or derivatives by the joints, (..., n) from those of all joints (..., m)."""
        return np.asarray(x @ self.matrix)
