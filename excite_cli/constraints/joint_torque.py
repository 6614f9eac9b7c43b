"""Bounds on the joint torques that the URDF's inertias predict."""

import numpy as np

from excite_cli.constraints.base import Array, Constraint, Indices
from excite_cli.robot.inverse_dynamics import InverseDynamics
from excite_cli.robot.model import Robot
from excite_cli.robot.states import States


class JointTorque(Constraint):
    """|τ_j| ≤ limit_j; columns: lower then upper side of every bounded joint."""

    name = "joint_torque"
    unit = "N·m"

    def __init__(self, robot: Robot, limits: Array) -> None:
        self._dynamics = InverseDynamics(robot)
        bounded = np.flatnonzero(np.isfinite(limits))
        self._joints = np.concatenate([bounded, bounded])
        self._signs = np.concatenate([-np.ones(len(bounded)), np.ones(len(bounded))])
        self._limits = limits[self._joints]
        self.scale = self._limits
        self._sliding = robot.sliding
        self.labels = tuple(
            f"{robot.joint_names[j]} {side}" for side in ("lower", "upper") for j in bounded
        )

    def unit_of(self, column: int) -> str:
        """Newtons for a prismatic joint."""
        return "N" if self._sliding[self._joints[column]] else self.unit

    def margins(self, states: States) -> Array:
        """limit − |τ| on either side (T, m) [N·m or N]."""
        torque = self._dynamics.torques(states.q, states.v, states.a)
        return self._limits - self._signs * torque[:, self._joints]

    def gradients(
        self, states: States, times: Indices, columns: Indices
    ) -> tuple[Array | None, Array | None, Array | None]:
        """Rows of the inverse-dynamics derivatives."""
        instants, inverse = np.unique(times, return_inverse=True)
        parts = self._dynamics.derivatives(
            states.q[instants], states.v[instants], states.a[instants]
        )
        sign = -self._signs[columns][:, None]
        by_q, by_v, by_a = (sign * part[inverse, self._joints[columns]] for part in parts)
        return by_q, by_v, by_a
