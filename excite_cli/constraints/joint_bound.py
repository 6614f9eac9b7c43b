"""Bounds on joint positions and their first three derivatives (Eq. 51): linear, one joint a row."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Mask
from excite_cli.config.constraints_spec import JointLimitsSpec
from excite_cli.constraints.base import Array, Constraint, Indices, Parts, part_of
from excite_cli.constraints.joint_columns import JointColumns, Quantity
from excite_cli.constraints.motor_limits import ORDERS, UNITS, MotorBound
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import ConfigError
from excite_cli.measurement.motors import Motors
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.robot.model import Robot

_TITLES = ("Joint position to its limit", "Joint speed to its limit",
           "Joint acceleration to its limit", "Joint jerk to its limit")  # fmt: skip
_SLIDING_UNITS = ("m", "m/s", "m/s²", "m/s³")


@dataclass(frozen=True)
class JointBound(Constraint):
    """lower ≤ x_j ≤ upper for the derivative of the given order (0 to 3) of q.

    `joints`, `signs`, `bounds` (m,): margin = bound − sign·x_joint. `scale` is half the range.
    """

    order: int
    joints: Indices
    signs: Array
    bounds: Array
    scale: Array
    labels: tuple[str, ...]
    sliding: Mask

    @property
    def name(self) -> str:  # type: ignore[override]
        """`joint_position`, `joint_velocity`, `joint_acceleration` or `joint_jerk`."""
        return f"joint_{ORDERS[self.order]}"

    @property
    def title(self) -> str:
        """Says which quantity."""
        return _TITLES[self.order]

    @property
    def of_joints(self) -> JointColumns:
        """One joint a column."""
        return JointColumns(Quantity(self.order), self.joints, self.signs, self.bounds)

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit of revolute joints; see `unit_of`."""
        return UNITS[self.order]

    def unit_of(self, column: int) -> str:
        """Metres instead of radians for a prismatic joint."""
        units = _SLIDING_UNITS if self.sliding[self.joints[column]] else UNITS
        return units[self.order]

    @classmethod
    def between(cls, order: int, lower: Array, upper: Array, robot: Robot) -> "JointBound":
        """Bounds (n,) of all joints of `robot`; infinite ones are left out."""
        names = robot.joint_names
        low, high = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        half = np.where(np.isfinite(upper - lower), (upper - lower) / 2, 1.0)
        joints = np.concatenate([low, high])
        return cls(
            order=order,
            joints=joints,
            signs=np.concatenate([-np.ones(len(low)), np.ones(len(high))]),
            bounds=np.concatenate([-lower[low], upper[high]]),
            scale=half[joints],
            labels=tuple(f"{names[j]} lower" for j in low)
            + tuple(f"{names[j]} upper" for j in high),
            sliding=robot.sliding,
        )

    @classmethod
    def build(cls, spec: JointLimitsSpec, setting: Setting) -> Iterable[Constraint]:
        """Of joint positions to jerks, and of those of motors that drive several joints."""
        robot = setting.robot
        found: list[Constraint] = []
        limits, names = robot.limits, robot.joint_names
        if spec.position:
            lower = limits.lower + spec.position_margin
            upper = limits.upper - spec.position_margin
            crossed = [n for n, low, high in zip(names, lower, upper, strict=True) if low >= high]
            if crossed:
                raise ConfigError(
                    f"constraints.joint_limits.position_margin: {spec.position_margin:g} leaves no "
                    f"range for {', '.join(crossed)}."
                )
            found.append(cls.between(0, lower, upper, robot))
        if spec.velocity is not False:
            given = None if spec.velocity is True else float(spec.velocity)
            speed = limits.velocity if given is None else np.minimum(limits.velocity, given)
            speed = spec.pace * spec.scale * speed
            found.append(cls.between(1, -speed, speed, robot))
        for order, own, given in (
            (2, limits.acceleration, spec.acceleration),
            (3, limits.jerk, spec.jerk),
        ):
            bound = spec.pace * (own if given is None else np.minimum(own, given))
            found.append(cls.between(order, -bound, bound, robot))
        of_motors = () if robot.motors is None else _motor_bounds(spec, robot.motors)
        return [bound for bound in (*found, *of_motors) if bound.labels]

    def values(self, states: States) -> Array:
        """The bounded quantity (T, n)."""
        return states.order(self.order)

    def margins(self, states: States) -> Array:
        """Distance to each bound (T, m)."""
        return self.bounds - self.signs * self.values(states)[:, self.joints]

    def least(self, motion: EnclosedMotion) -> Array:
        """bound − the most that sign·x_joint can be (T, m)."""
        x = motion.states.order(self.order)
        return self.bounds - x[:, self.joints].scaled(self.signs).upper()

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """−sign at the joint, zero elsewhere."""
        rows = np.zeros((len(times), states.q.shape[1]))
        rows[np.arange(len(times)), self.joints[columns]] = -self.signs[columns]
        return part_of(self.order, rows)


def _motor_bounds(spec: JointLimitsSpec, motors: Motors) -> Iterable[Constraint]:
    """As those of joints, for motors that drive several."""
    if spec.position:
        yield MotorBound(motors, 0, *motors.ranges())
    if spec.velocity is not False:
        speed = spec.pace * spec.scale * motors.bounds("velocity")
        yield MotorBound(motors, 1, -speed, speed)
    for order in (2, 3):
        bound = spec.pace * motors.bounds(ORDERS[order])
        yield MotorBound(motors, order, -bound, bound)
