"""Centre of mass and its Jacobian, batched over samples.

M c = Σ_j m_j (p_j + R_j c_j), with what stands still (body 0) included. For a moved joint l with
motion column S_l = [v; ω] about the world origin, M ∂c/∂q_l = Σ_{j ≥ l} m_j (v + ω × c_j^world).
"""

import numpy as np

from excite_cli.robot.model import Array, Robot
from excite_cli.robot.spatial_adjoint import cross
from excite_cli.robot.states import States


class CenterOfMass:
    """Centre of mass of `robot` with the inertias of its URDF."""

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        self._robot = robot
        self._mass = np.array([model.inertias[b].mass for b in range(1, model.njoints)])
        self._lever = np.array([model.inertias[b].lever for b in range(1, model.njoints)])
        still = model.inertias[0]
        self._still = still.mass * np.asarray(still.lever)
        self.total_mass = float(self._mass.sum() + still.mass)
        carries = np.zeros((robot.n, robot.n_bodies))
        first = int(model.njoints) - 1 - robot.n
        for body in range(1, model.njoints):
            for joint in model.supports[body]:
                if joint > first:
                    carries[joint - 1 - first, body - 1] = 1.0
        self._carries = carries

    def _moments(self, states: States) -> Array:
        """m_j c_j in the world, (T, B, 3)."""
        rotations, translations = states.placements
        levers = (rotations @ self._lever[:, :, None])[..., 0]
        return self._mass[:, None] * (translations + levers)

    def position(self, states: States) -> Array:
        """Centre of mass (T, 3) [m] in the world frame."""
        return (self._moments(states).sum(axis=1) + self._still) / self.total_mass

    def jacobian(self, states: States) -> Array:
        """∂c/∂q (T, 3, n) [m/rad or m/m]."""
        carried_mass = self._carries @ self._mass
        carried_moment = self._carries @ self._moments(states)
        columns = states.columns[:, self._robot.moved]
        derivative = columns[..., :3] * carried_mass[:, None]
        derivative = derivative + cross(columns[..., 3:], carried_moment)
        return derivative.transpose(0, 2, 1) / self.total_mass
