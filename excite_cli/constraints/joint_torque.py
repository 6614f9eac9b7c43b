"""Bounds on joint torques, by the URDF's inertias or any of a set, and what motors may give.

With uncertain inertias the torque Y_j φ of a joint must stay within its limit for every admitted φ:
limit + min_φ (∓ Y_j φ) ≥ 0. The derivative of that margin is a derivative of the torque with the
worst inertias, which differ between instants, joints and sides.

Where a motor's curve is given, the limit is that at the speed of the joint (`available_torque`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.config.constraints_spec import TorqueSpec
from excite_cli.constraints.base import Array, Constraint, Indices, Parts, at_rest
from excite_cli.constraints.joint_columns import JointColumns, Quantity
from excite_cli.constraints.motor_limits import MotorTorque
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.regressor import InverseDynamics, Regressor
from excite_cli.dynamics.row_adjoint import RowAdjoint
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.dynamics.whole_robot import drawn_states
from excite_cli.errors import ConfigError
from excite_cli.measurement.torque import check_joints
from excite_cli.measurement.torque_sources.base import per_joint
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.enclosed_rows import least_of, torque_rows
from excite_cli.proof.taylor import Taylor
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.model import Robot

_BY_DRIVE = " (measurement.command.limit)"


class JointTorque(Constraint):
    """±τ_j ≤ c_j(±v_j); columns: lower then upper side of every bounded joint.

    `curves` (n,): torque by speed; infinite: not bounded.

    `uncertainty`: admitted inertias of the whole robot; None: those of the URDF. `reasons` (n,)
    stand behind the labels of a joint: what its bound comes from, where that is no effort limit.
    """

    name = "joint_torque"
    of_forces = True
    title = "Joint torque left"
    unit = "N·m"

    def __init__(
        self,
        robot: Robot,
        curves: Sequence[EffortCurve],
        uncertainty: InertiaUncertainty | None = None,
        reasons: Sequence[str] | None = None,
    ) -> None:
        self._dynamics = InverseDynamics(robot)
        bounded = np.flatnonzero([np.isfinite(curve.efforts[0]) for curve in curves])
        self._joints = np.concatenate([bounded, bounded])
        self._signs = np.concatenate([-np.ones(len(bounded)), np.ones(len(bounded))])
        self._available = AvailableTorque(
            self._joints, self._signs, [curves[j] for j in self._joints]
        )
        self.scale = self._available.still
        self._sliding = robot.sliding
        why = np.array(reasons or [""] * robot.n)
        self.labels = tuple(
            f"{robot.joint_names[j]} {side}{why[j]}" for side in ("lower", "upper") for j in bounded
        )
        self.uncertainty = uncertainty
        self._admitted = (uncertainty or InertiaUncertainty.none(robot)).of_moving_bodies()
        if uncertainty is not None:
            self._regressor = Regressor(replace(robot, rows=robot.moved))
            drawn = drawn_states(robot)
            rows = self._regressor.evaluate(drawn.q, drawn.v, drawn.a)[:, bounded]
            self._admitted = self._admitted.sharpest(rows.reshape(-1, rows.shape[-1]))
            self._adjoint = RowAdjoint(robot)

    @classmethod
    def build(cls, spec: TorqueSpec, setting: Setting) -> Iterable[Constraint]:
        """Limits of joints, and of motors that drive several."""
        robot = setting.robot
        of_motors = np.full(robot.n, np.inf)
        if robot.motors is not None:
            of_motors = spec.scale * robot.motors.bounds("effort")
        found: list[Constraint] = []
        if np.isfinite(of_motors).any():
            found.append(MotorTorque(robot, of_motors, setting.uncertainty))
        limits = robot.limits.curves
        capped = [c.capped(most) for c, most in zip(limits, _of_drives(setting), strict=True)]
        reasons = ["" if c is own else _BY_DRIVE for c, own in zip(capped, limits, strict=True)]
        curves = [curve.scaled(spec.scale) for curve in capped]
        bounded = np.isfinite([curve.efforts[0] for curve in curves]).any()
        if not found and not bounded:
            raise ConfigError(
                "constraints.torque: the URDF gives no effort limits; give "
                "robot.limits.<joint>.effort."
            )
        if bounded:
            found.insert(0, cls(robot, curves, setting.uncertainty, reasons))
        return found

    @property
    def of_joints(self) -> JointColumns:
        """Both sides of every bounded joint, with the torque at no speed."""
        return JointColumns(Quantity.TORQUE, self._joints, self._signs, self._available.still)

    def unit_of(self, column: int) -> str:
        """Newtons for a prismatic joint."""
        return "N" if self._sliding[self._joints[column]] else self.unit

    def margins(self, states: States) -> Array:
        """limit − |τ| on either side (T, m) [N·m or N], the least over the admitted inertias."""
        return self._margins(states, states.v)

    def margins_at_rest(self, states: States) -> Array:
        """Those of standing still, with the torque that there is at the speed of `states`."""
        return self._margins(at_rest(states), states.v)

    def _margins(self, states: States, speed: Array) -> Array:
        available = self._available.at(speed)
        if self.uncertainty is None:
            torque = self._dynamics.torques(states.q, states.v, states.a)
            return available - self._signs * torque[:, self._joints]
        half = len(self._joints) // 2
        rows = self._regressor.evaluate(states.q, states.v, states.a)[:, self._joints[:half]]
        lower, upper = self._admitted.least_both(rows)
        return available + np.hstack([lower, upper])

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on what is left on either side (T, m), for every admitted inertia."""
        return self._least(motion, motion.states.v)

    def least_at_rest(self, motion: EnclosedMotion) -> Array:
        """The same of `margins_at_rest`."""
        return self._least(motion.at_rest, motion.states.v)

    def _least(self, motion: EnclosedMotion, speed: Taylor) -> Array:
        half = len(self._joints) // 2
        rows = torque_rows(motion)[:, self._joints[:half]]
        available = self._available.least(speed)
        below = least_of(rows, self._admitted, available[:, :half])
        above = least_of(-rows, self._admitted, available[:, half:])
        return np.hstack([below, above])

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Slope of the limit less rows of the inverse-dynamics derivatives, of worst inertias."""
        by_q, by_v, by_a = self._torque_gradients(states, times, columns)
        self._available.add_slopes(by_v, states.v[times], columns)
        return by_q, by_v, by_a

    def gradients_at_rest(self, states: States, times: Indices, columns: Indices) -> Parts:
        """By position, of the torque, and by speed, of the limit."""
        by_q, by_v, _ = self._torque_gradients(at_rest(states), times, columns)
        by_v = 0.0 * by_v
        self._available.add_slopes(by_v, states.v[times], columns)
        return by_q, by_v

    def _torque_gradients(
        self, states: States, times: Indices, columns: Indices
    ) -> tuple[Array, Array, Array]:
        joints, sign = self._joints[columns], -self._signs[columns][:, None]
        if self.uncertainty is not None:
            return self._robust_gradients(states, times, joints, sign)
        instants, inverse = np.unique(times, return_inverse=True)
        parts = self._dynamics.derivatives(
            states.q[instants], states.v[instants], states.a[instants]
        )
        by_q, by_v, by_a = (sign * part[inverse, joints] for part in parts)
        return by_q, by_v, by_a

    def _robust_gradients(
        self, states: States, times: Indices, joints: Indices, sign: Array
    ) -> tuple[Array, Array, Array]:
        q, v, a = states.q, states.v, states.a
        instants, inverse = np.unique(times, return_inverse=True)
        rows = self._regressor.evaluate(q[instants], v[instants], a[instants])[inverse, joints]
        phi = sign * self._admitted.worst(sign * rows)
        return self._adjoint.torques(q, v, a, times, joints, phi)


def _of_drives(setting: Setting) -> Array:
    """Torques (n,) at which drives that follow set points stop, infinite where none is given."""
    measurement, names = setting.measurement, setting.robot.joint_names
    if measurement.torque != "command" or measurement.command.limit is None:
        return np.full(len(names), np.inf)
    check_joints(measurement, names)
    return per_joint(measurement.command.limit, names, np.inf)


# The torque that bounded joints may give on either side, at the speed that they have.
#
# Column k bounds sign_k τ_j by c_j(sign_k v_j), with c_j the curve of the joint's motor
# (`robot.effort_curve`), a constant for most.


class AvailableTorque:
    """Columns (m,) of `joints` with `signs`; `curves` (m,) [N·m or N]."""

    def __init__(self, joints: Indices, signs: Array, curves: Sequence[EffortCurve]) -> None:
        self._joints, self._signs, self._curves = joints, signs, tuple(curves)
        self.still = np.array([curve.efforts[0] for curve in self._curves])
        """What there is of torque at no speed (m,)."""
        self._varying = [k for k, curve in enumerate(self._curves) if len(curve.speeds) > 1]

    def at(self, v: Array) -> Array:
        """c(sign v) (T, m) at speeds (T, n)."""
        found = np.tile(self.still, (len(v), 1))
        for k in self._varying:
            found[:, k] = self._curves[k].effort(self._signs[k] * v[:, self._joints[k]])
        return found

    def add_slopes(self, by_v: Array, v: Array, columns: Indices) -> None:
        """Add the derivatives of c(sign v) at speeds (K, n) of `columns` (K,) to `by_v` (K, n)."""
        for k in self._varying:
            rows, sign = np.flatnonzero(columns == k), self._signs[k]
            joint = self._joints[k]
            by_v[rows, joint] += sign * self._curves[k].slope(sign * v[rows, joint])

    def least(self, v: Taylor) -> Taylor:
        """What is below c(sign v) (T, m) throughout intervals, with v enclosing (T, n).

        Where speeds stay on one line, that line; else the torque at the highest of them, since no
        curve rises.
        """
        terms = np.zeros((3, v.shape[0], len(self._curves)))
        terms[0] = self.still
        radius = np.zeros(terms.shape[1:])
        for k in self._varying:
            curve, speed = self._curves[k], v[:, self._joints[k]].scaled(self._signs[k])
            first, last = curve.line(speed.lower()), curve.line(speed.upper())
            slope = np.where(first == last, curve.slopes[first], 0.0)
            one_line = speed.scaled(slope) + (curve.efforts[first] - slope * curve.speeds[first])
            terms[:, :, k], radius[:, k] = one_line.terms, one_line.radius
            terms[0, :, k] = np.where(first == last, one_line.terms[0], curve.effort(speed.upper()))
        return Taylor(terms, radius)
