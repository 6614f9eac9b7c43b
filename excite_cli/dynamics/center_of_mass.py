"""Centre of mass and its Jacobian, batched over samples.

M c = Σ_j m_j (p_j + R_j c_j), with what stands still (body 0) included. For a moved joint l with
motion column S_l = [v; ω] about the world origin, M ∂c/∂q_l = Σ_{j ≥ l} m_j (v + ω × c_j^world).

Mass and first moment are linear in (m, m c) of every body, which is what uncertain inertias need.
"""

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.spatial_adjoint import cross
from excite_cli.robot.carried_bodies import carried_bodies
from excite_cli.robot.model import Array, Robot


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
        self._carries = carried_bodies(robot).T[:, 1:]

    def _moments(self, states: States) -> Array:
        """m_j c_j in the world, (T, B, 3)."""
        rotations, translations = states.placements
        levers = rotations[..., 0] * self._lever[:, :1]  # written out: faster than small products
        levers += rotations[..., 1] * self._lever[:, 1:2]
        levers += rotations[..., 2] * self._lever[:, 2:]
        return self._mass[:, None] * (translations + levers)

    def position(self, states: States) -> Array:
        """Centre of mass (T, 3) [m] in the world frame."""
        return (self._moments(states).sum(axis=1) + self._still) / self.total_mass

    def jacobian(self, states: States) -> Array:
        """∂c/∂q (T, 3, n) [m/rad or m/m]."""
        carried_mass = self._carries @ self._mass
        carried_moment = self._carries @ self._moments(states)
        columns = states.columns[:, self._robot.tree.moved]
        derivative = columns[..., :3] * carried_mass[:, None]
        derivative = derivative + cross(columns[..., 3:], carried_moment)
        return self._robot.gathered(derivative.transpose(0, 2, 1)) / self.total_mass

    def rows(self, states: States) -> Array:
        """M, Σ m x, Σ m y as rows (T, 3, 4·(1 + n_bodies)) on m, m c of what stands still first."""
        rotations, translations = states.placements
        found = np.zeros((len(states.q), 3, 1 + self._robot.n_bodies, 4))
        found[:, 0, :, 0] = 1.0
        found[:, 1:, 0, 1:] = np.eye(3)[:2]
        found[:, 1:, 1:, 0] = translations[..., :2].transpose(0, 2, 1)
        found[:, 1:, 1:, 1:] = rotations[:, :, :2].transpose(0, 2, 1, 3)
        return found.reshape(len(states.q), 3, -1)

    def moment_gradients(
        self, states: States, times: NDArray[np.intp], normals: Array, masses: Array
    ) -> Array:
        """∂(normal·Σ m c)/∂q (K, n) at `times` (K,), each with m, m c of its own.

        `normals` (K, 2) horizontal; `masses` (K, 4·(1 + n_bodies)) as `rows` takes them.
        """
        rotations, translations = states.placements
        moving = masses.reshape(len(times), -1, 4)[:, 1:]
        mass, first = moving[..., :1], moving[..., 1:, None]
        moments = mass * translations[times] + (rotations[times] @ first)[..., 0]
        columns = states.columns[:, self._robot.tree.moved][times]
        change = columns[..., :3] * (self._carries @ mass)
        change = change + cross(columns[..., 3:], self._carries @ moments)
        return self._robot.gathered(np.asarray((change[..., :2] @ normals[..., None])[..., 0]))
