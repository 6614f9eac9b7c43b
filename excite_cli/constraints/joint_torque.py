"""Bounds on the joint torques that the URDF's inertias predict, or that any of a set would need.

With uncertain inertias the torque Y_j φ of a joint must stay within its limit for every admitted φ:
limit + min_φ (∓ Y_j φ) ≥ 0. The derivative of that margin is a derivative of the torque with the
worst inertias, which differ between instants, joints and sides.

Where a motor's curve is given, the limit is that at the speed of the joint (`available_torque`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.config.constraints_spec import TorqueSpec
from excite_cli.constraints.available_torque import AvailableTorque
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.joint_columns import JointColumns, Quantity
from excite_cli.constraints.motor_limits import MotorTorque
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.regressor import InverseDynamics, Regressor
from excite_cli.dynamics.row_adjoint import RowAdjoint
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.dynamics.whole_robot import drawn_states
from excite_cli.errors import ConfigError
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.enclosed_rows import least_of, torque_rows
from excite_cli.robot.effort_curve import EffortCurve
from excite_cli.robot.model import Robot


class JointTorque(Constraint):
    """±τ_j ≤ c_j(±v_j); columns: lower then upper side of every bounded joint.

    `curves` (n,): torque by speed; infinite: not bounded.

    `uncertainty`: admitted inertias of the whole robot; None: those of the URDF.
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
        self.labels = tuple(
            f"{robot.joint_names[j]} {side}" for side in ("lower", "upper") for j in bounded
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
        if not found and not np.isfinite(robot.limits.effort).any():
            raise ConfigError(
                "constraints.torque: the URDF gives no effort limits; give "
                "robot.limits.<joint>.effort."
            )
        if np.isfinite(robot.limits.effort).any():
            curves = [curve.scaled(spec.scale) for curve in robot.limits.curves]
            by_speed = [
                name
                for name, curve in zip(robot.joint_names, curves, strict=True)
                if len(curve.speeds) > 1
            ]
            if by_speed and setting.spec.any_speed:
                raise ConfigError(
                    f"robot.limits.{by_speed[0]}.effort_by_speed: with constraints.any_speed a "
                    "motion must hold at any lower speed, which is not proved of torque that "
                    "falls with speed. Give effort instead, the torque at the highest speed, or "
                    "leave any_speed out."
                )
            found.insert(0, cls(robot, curves, setting.uncertainty))
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
        available = self._available.at(states.v)
        if self.uncertainty is None:
            torque = self._dynamics.torques(states.q, states.v, states.a)
            return available - self._signs * torque[:, self._joints]
        half = len(self._joints) // 2
        rows = self._regressor.evaluate(states.q, states.v, states.a)[:, self._joints[:half]]
        lower, upper = self._admitted.least_both(rows)
        return available + np.hstack([lower, upper])

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on what is left on either side (T, m), for every admitted inertia."""
        half = len(self._joints) // 2
        rows = torque_rows(motion)[:, self._joints[:half]]
        available = self._available.least(motion.states.v)
        below = least_of(rows, self._admitted, available[:, :half])
        above = least_of(-rows, self._admitted, available[:, half:])
        return np.hstack([below, above])

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Slope of the limit less rows of the inverse-dynamics derivatives, of worst inertias."""
        by_q, by_v, by_a = self._torque_gradients(states, times, columns)
        self._available.add_slopes(by_v, states.v[times], columns)
        return by_q, by_v, by_a

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
