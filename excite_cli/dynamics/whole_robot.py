"""The whole robot, what stands still included: its parameters, and the wrench the ground gives.

Gravity and motion ask, for every body, for a force f_b = I_b A_b + V_b ×* (I_b V_b); the ground (or
what the base is fixed to) must give their sum. About the world origin, in world axes, that wrench
W = [force; moment] is linear in φ (10·(1 + n_bodies),), body 0 being what is fixed to the world.
"""

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.base_parameters import DUST, BaseParameters
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.regressor import Regressor, standard_parameter_names
from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint, body_regressors, cross, to_local
from excite_cli.errors import ConfigError
from excite_cli.robot.link_frame import carried_bodies, carrying_frame
from excite_cli.robot.model import Array, Robot, links_by_joint

# The ten parameters of what a link carries, as the columns of a motion that is to show them.

_SAMPLES, _SEED = 200, 20170529
_TELLS_APART = 1e-8


def load_parameters(robot: Robot, link: str | None) -> BaseParameters:
    """Mass, first moments and inertia about the joint that carries `link`, the robot being known.

    All ten are columns, whatever of them the robot's own parameters group.

    Raises
    ------
    ConfigError
        The link is unknown or must be named, or no motion tells all ten apart.
    """
    frame = carrying_frame(robot, link, "criterion.load_link")
    selection = 10 * (robot.model_joints[frame.joint] - 1) + np.arange(10)
    y = Regressor(robot).evaluate(*robot.draw_states(_SAMPLES, _SEED))[:, :, selection]
    rows = y.reshape(-1, 10)
    sizes = np.linalg.norm(rows, axis=0)
    names = standard_parameter_names(robot)
    if sizes.min() <= DUST * sizes.max() or (np.linalg.cond(rows / sizes) > 1.0 / _TELLS_APART):
        raise ConfigError(
            f"criterion.of: no motion of these joints shows all ten parameters of a load on "
            f"{frame.name}: a wrist with fewer axes turns it about some only. Move more joints "
            "(robot.joints)."
        )
    mapping = np.eye(10 * robot.n_bodies)[selection]
    return BaseParameters(selection, mapping, names, 0.0, 0.0)


def whole_parameters(robot: Robot) -> Array:
    """φ (10·(1 + n_bodies),) of the URDF; zeros first if nothing is fixed to the world."""
    return np.concatenate([inertia.toDynamicParameters() for inertia in robot.model.inertias])


def body_names(robot: Robot) -> tuple[tuple[str, ...], ...]:
    """Names of every body from body 0 on: its joint, or `base`; then the links it consists of."""
    links = links_by_joint(robot)
    base = ("base", *links.get("", []))
    still = ((), base) if robot.floating else (base,)
    return (*still, *((name, *links.get(name, [])) for name in robot.tree.joint_names))


def drawn_states(robot: Robot, count: int = 30, seed: int = 0) -> States:
    """Random states within the limits, to see how functionals of φ look."""
    return States(BatchKinematics(robot), *robot.draw_states(count, seed))


class GroundWrench:
    """Regressor of the wrench (T, 6, 10·(1 + n_bodies)) [N, N·m] about the world origin."""

    def __init__(self, robot: Robot) -> None:
        self._adjoint = SpatialAdjoint(robot)
        self._gravity = np.concatenate([-np.asarray(robot.model.gravity.linear), np.zeros(3)])
        self._last: tuple[States, Array] | None = None

    def regressor(self, states: States) -> Array:
        """The regressor at `states`; those last requested are kept."""
        if self._last is None or self._last[0] is not states:
            self._last = states, self._evaluated(states)
        return self._last[1]

    def _evaluated(self, states: States) -> Array:
        motion = self._adjoint.body_motion(states.q, states.v, states.a)
        samples = len(states.q)
        shape = (samples, 1, 6)
        velocity = np.concatenate([np.zeros(shape), motion.velocity], axis=1)
        acceleration = np.concatenate(
            [np.broadcast_to(self._gravity, shape), motion.acceleration], axis=1
        )
        upright = np.broadcast_to(np.eye(3), (samples, 1, 3, 3))
        turn = np.concatenate([upright, motion.rotations], axis=1)
        place = np.concatenate([np.zeros((samples, 1, 3)), motion.translations], axis=1)
        back = turn.swapaxes(-1, -2)
        velocity = to_local(back, place, velocity)
        acceleration = to_local(back, place, acceleration)
        acceleration[..., :3] += cross(velocity[..., 3:], velocity[..., :3])
        local = body_regressors(velocity, acceleration)
        force, moment = turn @ local[..., :3, :], turn @ local[..., 3:, :]
        moment += cross(place[..., None, :], force.swapaxes(-1, -2)).swapaxes(-1, -2)
        wrench = np.concatenate([force, moment], axis=-2)
        return np.asarray(wrench.transpose(0, 2, 1, 3).reshape(samples, 6, -1))


# Centre of mass and its Jacobian, batched over samples.
#
# M c = Σ_j m_j (p_j + R_j c_j), with what stands still (body 0) included. For a moved joint l with
# motion column S_l = [v; ω] about the world origin, M ∂c/∂q_l = Σ_{j ≥ l} m_j (v + ω × c_j^world).
#
# Mass and first moment are linear in (m, m c) of every body, which is what uncertain inertias need.


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
