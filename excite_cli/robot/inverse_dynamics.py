"""Torques of the moved joints with the URDF's inertias, and their derivatives."""

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot


class InverseDynamics:
    """τ(q, v, a) for many samples; not to be shared between threads."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._data = robot.model.createData()

    def _pinocchio_states(self, q: Array, v: Array, a: Array) -> zip:
        robot = self.robot
        return zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """τ (T, n) [N·m or N]."""
        model, data = self.robot.model, self._data
        full = [pin.rnea(model, data, *state).copy() for state in self._pinocchio_states(q, v, a)]
        return np.array(full).reshape(len(q), model.nv)[:, self.robot.moved]

    def derivatives(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """∂τ/∂q, ∂τ/∂v, ∂τ/∂a, each (T, n, n)."""
        model, data, moved = self.robot.model, self._data, self.robot.moved
        parts = np.empty((3, len(q), len(moved), len(moved)))
        at = np.ix_(moved, moved)
        for t, state in enumerate(self._pinocchio_states(q, v, a)):
            pin.computeRNEADerivatives(model, data, *state)
            mass = np.triu(data.M)
            mass = mass + np.triu(mass, 1).T
            parts[:, t] = data.dtau_dq[at], data.dtau_dv[at], mass[at]
        return parts[0], parts[1], parts[2]
