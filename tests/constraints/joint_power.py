"""A constraint of one's own: the power τ_j v_j that every joint takes stays below a limit.

Together with a line in the catalogue this file is all that it takes.
"""

import numpy as np

from excite_cli.constraints.base import Array, Constraint, Indices
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.robot.model import Robot


class JointPower(Constraint):
    """limit − τ_j v_j, one column a joint."""

    name = "joint_power"
    unit = "W"

    def __init__(self, robot: Robot, limit: float) -> None:
        self._dynamics, self._limit = InverseDynamics(robot), limit
        self.labels = robot.joint_names
        self.scale = np.full(robot.n, limit)

    def margins(self, states: States) -> Array:
        torque = self._dynamics.torques(states.q, states.v, states.a)
        return self._limit - torque * states.v

    def gradients(
        self, states: States, times: Indices, columns: Indices
    ) -> tuple[Array | None, Array | None, Array | None]:
        q, v, a = states.q[times], states.v[times], states.a[times]
        at = (np.arange(len(times)), columns)
        speed = v[at][:, None]
        by_q, by_v, by_a = (part[at] for part in self._dynamics.derivatives(q, v, a))
        by_speed = -speed * by_v
        by_speed[at] -= self._dynamics.torques(q, v, a)[at]
        return -speed * by_q, by_speed, -speed * by_a
