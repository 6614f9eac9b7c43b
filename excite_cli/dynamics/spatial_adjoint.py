"""Vector–Jacobian products of the regressor: for any weight Z, and by fictitious inertias.

Smooth criteria need many singular pairs, and one inverse-dynamics pass for each is slow. Here all
pairs are taken at once. By virtual power, with S_i the motion column of row i and f_j(·) the force
that body j needs (regressor Y_j, local frame of j),

    L = Z : Y = Σ_j P_j : Y_j,      P_j = Σ_{i ≤ j} S_i^(j) Z_ijᵀ    (6 × 10, frame of j),

where i ≤ j means that joint i carries body j. Y_j depends on the body's velocity V_j and
acceleration A_j (gravity included) only, so L has gradients g^V_j, g^A_j with respect to them. In
world coordinates, with Ṡ_l = V_l × S_l and S̈_l = A_l × S_l + V_l × Ṡ_l, for l ≤ j

    ∂V_j/∂q_l → Ṡ_l         ∂A_j/∂q_l → S̈_l + Ṡ_l × V_j        (both seen from frame j)
    ∂V_j/∂v_l → S_l         ∂A_j/∂v_l → 2 Ṡ_l + S_l × V_j
    ∂A_j/∂a_l → S_l         ∂P_j/∂q_l → − Σ_{i < l} (S_l × S_i) Z_ijᵀ

(the sums over joints between l and j telescope). Hence with subtree sums Σ_{j ≥ l} and
h_j = V_j ×* g^A_j,

    ∂L/∂q_l = S̈_l·Σ g^A + Ṡ_l·Σ (g^V + h) − S_l·Σ_{i < l} S_i ×* Σ f_j(Z_ij)
    ∂L/∂v_l = 2 Ṡ_l·Σ g^A + S_l·Σ (g^V + h),        ∂L/∂a_l = S_l·Σ g^A.

The cost does not depend on the number of pairs. All of it is about joints that move on their own
(`Robot.tree`); where some follow others, states are spread to all and derivatives gathered.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Indices
from excite_cli.dynamics.forward_kinematics import BatchKinematics
from excite_cli.kernels.compiled import KERNELS
from excite_cli.robot.model import Array, Robot

# [ω•]: I ω = [ω•] (Ixx, Ixy, Iyy, Ixz, Iyz, Izz); _INERTIA[k] is the matrix for ω = e_k.
_INERTIA = np.zeros((3, 3, 6))
for _row, _column, _component in (
    (0, 0, 0), (0, 1, 1), (0, 3, 2),
    (1, 1, 0), (1, 2, 1), (1, 4, 2),
    (2, 3, 0), (2, 4, 1), (2, 5, 2),
):  # fmt: skip
    _INERTIA[_component, _row, _column] = 1.0
_SKEW = np.array(
    [
        [[0, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
        [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
    ],
    dtype=float,
)
_BY_SPIN = _INERTIA.reshape(3, 18).T.copy()
_BY_SPIN_TWICE = np.einsum("kab,lbc->klac", _SKEW, _INERTIA)
_BY_SPIN_TWICE = (_BY_SPIN_TWICE + _BY_SPIN_TWICE.transpose(1, 0, 2, 3)).reshape(9, 18).T.copy()


@dataclass(frozen=True)
class BodyMotion:
    """World-frame columns S, Ṡ (T, nv, 6), velocities and accelerations V, A (T, B, 6)."""

    rotations: Array
    translations: Array
    columns: Array
    column_rates: Array
    velocity: Array
    acceleration: Array


def cross(a: Array, b: Array) -> Array:
    """a × b over the last axis, broadcasting; several times faster than `numpy.cross`."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def motion_cross(a: Array, b: Array) -> Array:
    """Spatial a × b of motions [linear; angular]."""
    linear = cross(a[..., 3:], b[..., :3]) + cross(a[..., :3], b[..., 3:])
    return np.concatenate([linear, cross(a[..., 3:], b[..., 3:])], axis=-1)


def _force_cross(a: Array, f: Array) -> Array:
    """Spatial a ×* f of a motion and a force."""
    moment = cross(a[..., :3], f[..., :3]) + cross(a[..., 3:], f[..., 3:])
    return np.concatenate([cross(a[..., 3:], f[..., :3]), moment], axis=-1)


class SpatialAdjoint:
    """Vector–Jacobian product for any number of pairs at the cost of one."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._kinematics = BatchKinematics(robot)
        model = robot.model
        dof_body = [
            body - 1 for body in range(1, model.njoints) for _ in range(model.joints[body].nv)
        ]
        carries = np.zeros((robot.n_bodies, robot.n_bodies))
        for body in range(1, model.njoints):
            carries[body - 1, [int(j) - 1 for j in model.supports[body] if j > 0]] = 1.0
        self._dof_body = np.array(dof_body, dtype=np.int64)
        tree = robot.tree
        self._moved = np.array(tree.moved, dtype=np.int64)
        self._rows = np.array(tree.rows, dtype=np.int64)
        self._carried = np.ascontiguousarray(carries[:, self._dof_body])
        strict = self._carried[self._dof_body][:, :] - np.equal.outer(dof_body, dof_body)
        self._strict = strict[np.ix_(tree.moved, tree.rows)]
        self._gravity = np.concatenate([-np.asarray(model.gravity.linear), np.zeros(3)])

    @property
    def _structure(self) -> tuple[Array | Indices, ...]:
        """The tree as the compiled functions take it."""
        tree = self._kinematics
        return (
            tree.parents, self._dof_body, tree.variable, self._moved, self._rows, self._carried,
            tree.twists, self._gravity,
        )  # fmt: skip

    def regressor(self, q: Array, v: Array, a: Array, kept: Indices) -> Array:
        """Columns `kept` (r,) of the regressor for the measured rows, (T, R, r); compiled only.

        As `Regressor`, which goes through Pinocchio, by the recursion of `pull_back`: row i of a
        body that joint i carries is its column S_i, seen from the body, times Y_j.
        """
        assert KERNELS is not None
        robot, tree = self.robot, self._kinematics
        position = np.full(10 * robot.n_bodies, -1, dtype=np.int64)
        position[kept] = np.arange(len(kept))
        found = np.zeros((len(q), len(self._rows), len(kept)))
        KERNELS.call(
            "regressor", *self._structure, *tree.placements(q), *self._all_rates(v, a), position,
            found,
        )  # fmt: skip
        return robot.gathered_rows(found)

    def _all_rates(self, *rates: Array) -> list[Array]:
        """As the compiled functions take them."""
        every = map(self.robot.all_rates, rates)
        return [np.ascontiguousarray(part, dtype=float) for part in every]

    def pull_back(
        self, q: Array, v: Array, a: Array, left: Array, right: Array
    ) -> tuple[Array, Array, Array]:
        """Derivative of Σ_k Σ_t left_ktᵀ Y(x_t) right_k; see `FictitiousInertiaAdjoint`."""
        weights = left.transpose(1, 2, 0) @ right
        return self.pull_back_dense(q, v, a, weights)

    def pull_back_dense(
        self, q: Array, v: Array, a: Array, weights: Array
    ) -> tuple[Array, Array, Array]:
        """Derivative of Σ_t Z_t : Y(x_t) with respect to x_t.

        Parameters
        ----------
        q, v, a: (T, n) of the moved joints
        weights: Z (T, R, 10·n_bodies)

        Returns
        -------
        gq, gv, ga, each (T, n)
        """
        gathered, weights = self.robot.gathered, self.robot.spread_rows(weights)
        if KERNELS is None:
            gq, gv, ga = self._pull_back_by_passes(q, v, a, weights)
            return gathered(gq), gathered(gv), gathered(ga)
        found = np.empty((3, len(q), len(self._moved)))
        KERNELS.call(
            "pull_back", *self._structure, _BY_SPIN, _BY_SPIN_TWICE,
            *self._kinematics.placements(q), *self._all_rates(v, a),
            np.ascontiguousarray(weights, dtype=float), *found,
        )  # fmt: skip
        return gathered(found[0]), gathered(found[1]), gathered(found[2])

    def _pull_back_by_passes(
        self, q: Array, v: Array, a: Array, weights: Array
    ) -> tuple[Array, Array, Array]:
        """`pull_back_dense` of the tree in NumPy, all samples at once."""
        robot, moved = self.robot, self._moved
        samples, rows = len(q), len(self._rows)
        motion = self.body_motion(q, v, a)
        by_body = np.ascontiguousarray(
            weights.reshape(samples, rows, robot.n_bodies, 10).transpose(0, 2, 1, 3)
        )
        turned = motion.rotations.transpose(0, 1, 3, 2)
        projected = self._local_columns(motion, turned) @ by_body
        velocity = to_local(turned, motion.translations, motion.velocity)
        acceleration = to_local(turned, motion.translations, motion.acceleration)
        acceleration[..., :3] += cross(velocity[..., 3:], velocity[..., :3])
        by_velocity, by_acceleration = _body_gradients(projected, velocity, acceleration)
        by_velocity = _force_to_world(motion, by_velocity)
        by_acceleration = _force_to_world(motion, by_acceleration)
        by_velocity += _force_cross(motion.velocity, by_acceleration)
        subtree = self._carried[:, moved].T
        by_velocity, by_acceleration = subtree @ by_velocity, subtree @ by_acceleration
        column, rate = motion.columns[:, moved], motion.column_rates[:, moved]
        body = self._dof_body[moved]
        second_rate = motion_cross(motion.acceleration[:, body], column) + motion_cross(
            motion.velocity[:, body], rate
        )
        carried = self._carried_forces(motion, velocity, acceleration, by_body)
        gq = (second_rate * by_acceleration + rate * by_velocity - column * carried).sum(-1)
        gv = (2 * rate * by_acceleration + column * by_velocity).sum(-1)
        return gq, gv, (column * by_acceleration).sum(-1)

    def body_motion(self, q: Array, v: Array, a: Array) -> BodyMotion:
        """Velocities and accelerations (gravity included) of all bodies in the world frame."""
        moved, (v, a) = self._moved, self._all_rates(v, a)
        rotations, translations = self._kinematics.placements(q)
        columns = self._kinematics.axes(rotations, translations)
        moving = self._carried[:, moved]
        speeds = columns[:, moved] * v[..., None]
        velocity = moving @ speeds
        rates = motion_cross(velocity[:, self._dof_body], columns)
        accelerations = columns[:, moved] * a[..., None]
        accelerations += rates[:, moved] * v[..., None]
        acceleration = moving @ accelerations + self._gravity
        return BodyMotion(rotations, translations, columns, rates, velocity, acceleration)

    def _local_columns(self, motion: BodyMotion, turned: Array) -> Array:
        """S_i^(j) for the measured rows i, zero unless i carries j: (T, B, 6, R)."""
        rows = self._rows
        columns = motion.columns[:, rows].transpose(0, 2, 1)
        samples, bodies = turned.shape[:2]
        flat = turned.reshape(samples, bodies * 3, 3)
        lever = cross(motion.translations[:, :, None, :], turned).reshape(samples, bodies * 3, 3)
        local = np.empty((samples, bodies, 6, len(rows)))
        shape = (samples, bodies, 3, len(rows))
        local[:, :, :3] = (flat @ columns[:, :3] + lever @ columns[:, 3:]).reshape(shape)
        local[:, :, 3:] = (flat @ columns[:, 3:]).reshape(shape)
        return local * self._carried[:, rows][:, None, :]

    def _carried_forces(
        self, motion: BodyMotion, velocity: Array, acceleration: Array, by_body: Array
    ) -> Array:
        """Σ_{i < l} S_i ×* Σ_{j ≥ l} f_j(Z_ij) for the moved joints l: (T, m, 6)."""
        forces = body_regressors(velocity, acceleration) @ by_body.transpose(0, 1, 3, 2)
        linear = motion.rotations @ forces[:, :, :3]
        angular = motion.rotations @ forces[:, :, 3:]
        moments = cross(motion.translations[:, :, None, :], linear.swapaxes(2, 3))
        angular += moments.swapaxes(2, 3)
        world = np.concatenate([linear, angular], axis=2)
        samples, bodies = world.shape[:2]
        summed = self._carried[:, self._moved].T @ world.reshape(samples, bodies, -1)
        summed = summed.reshape(samples, len(self._moved), 6, -1) * self._strict[:, None, :]
        outer = summed @ motion.columns[:, None, self._rows]
        linear = _axial(outer[..., :3, 3:])
        angular = _axial(outer[..., :3, :3]) + _axial(outer[..., 3:, 3:])
        return np.concatenate([linear, angular], axis=-1)


def _axial(m: Array) -> Array:
    """M : [e_k×] for k = x, y, z, over the last two axes."""
    return np.stack(
        [m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]],
        axis=-1,
    )


def to_local(turned: Array, translations: Array, spatial: Array) -> Array:
    """Motions (…, 6) about the world origin, in the frames of bodies; `turned` leads there."""
    linear = spatial[..., :3] + cross(spatial[..., 3:], translations)
    both = np.stack([linear, spatial[..., 3:]], axis=-1)
    local = turned @ both
    return np.concatenate([local[..., 0], local[..., 1]], axis=-1)


def _force_to_world(motion: BodyMotion, force: Array) -> Array:
    both = motion.rotations @ np.stack([force[..., :3], force[..., 3:]], axis=-1)
    linear, angular = both[..., 0], both[..., 1]
    return np.concatenate([linear, angular + cross(motion.translations, linear)], axis=-1)


def body_regressors(velocity: Array, acceleration: Array) -> Array:
    """Y_j (T, B, 6, 10) from local velocity and [point acceleration; angular acceleration]."""
    spin, point, turn = velocity[..., 3:], acceleration[..., :3], acceleration[..., 3:]
    y = np.zeros((*spin.shape[:2], 6, 10))
    skew = np.tensordot(spin, _SKEW, 1)
    by_spin = np.tensordot(spin, _INERTIA, 1)
    y[..., :3, 0] = point
    y[..., :3, 1:4] = np.tensordot(turn, _SKEW, 1) + skew @ skew
    y[..., 3:, 1:4] = -np.tensordot(point, _SKEW, 1)
    y[..., 3:, 4:] = np.tensordot(turn, _INERTIA, 1) + skew @ by_spin
    return y


def _body_gradients(projected: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
    """Gradients of P_j : Y_j with respect to the local spatial V_j and A_j, each (T, B, 6)."""
    first = projected[..., :3, 1:4]
    inertia = projected[..., 3:, 4:].reshape(*projected.shape[:2], 18)
    linear, spin = velocity[..., :3], velocity[..., 3:]
    by_point = projected[..., :3, 0] - _axial(projected[..., 3:, 1:4])
    by_turn = _axial(first) + inertia @ _BY_SPIN
    quadratic = (inertia @ _BY_SPIN_TWICE).reshape(first.shape)
    quadratic = quadratic + first + first.transpose(0, 1, 3, 2)
    trace = 2 * np.trace(first, axis1=-2, axis2=-1)[..., None]
    by_spin = (quadratic @ spin[..., None])[..., 0] - trace * spin
    by_velocity = np.concatenate([cross(by_point, spin), by_spin + cross(linear, by_point)], -1)
    return by_velocity, np.concatenate([by_point, by_turn], axis=-1)


# Vector–Jacobian product of the regressor by inverse dynamics with fictitious inertias.
#
# For one sample and one pair (u, φ), uᵀ Y(x) φ = uᵀ ID(x; φ): the regressor times a vector is the
# inverse dynamics of a robot with inertias φ. So the derivative of Σ_k u_kᵀ Y φ_k needs no
# derivative of the regressor, only one RNEA-derivatives pass per pair:
#
#     ∂/∂x = Σ_k u_kᵀ ∂ID(x; φ_k)/∂x.
#
# Pinocchio stores a body as (m, c, I_c), which breaks down for m ≈ 0. ID is linear in φ, so a shift
# is free of error where it can be told apart or does not show:
# - a direction d of the standard parameters that no torque shows (Y d = 0, masses all non-zero,
#   from the base parameters' grouping) may be added outright: ID(·; φ + s d) = ID(·; φ);
# - without one, ID(·; φ) = ID(·; φ + s φ_ref) − s ID(·; φ_ref) with a fixed unit inertia φ_ref, the
#   second pass being shared by all pairs.

_REFERENCE = np.array([1.0, 0, 0, 0, 1.0, 0, 1.0, 0, 0, 1.0])


class FictitiousInertiaAdjoint:
    """Few singular pairs (the condition number has two); not to be shared between threads."""

    def __init__(self, robot: Robot, silent: Array | None = None) -> None:
        """`silent`: a direction (P,) with Y d = 0 (`BaseParameters.silent_direction`), if any."""
        self.robot = robot
        self._model = robot.model.copy()
        self._data = self._model.createData()
        self._silent = silent if silent is not None and _shifts_every_mass(silent) else None

    def pull_back(
        self, q: Array, v: Array, a: Array, left: Array, right: Array
    ) -> tuple[Array, Array, Array]:
        """Derivative of Σ_k Σ_t left_ktᵀ Y(x_t) right_k with respect to x_t.

        Parameters
        ----------
        q, v, a: (T, n) of the moved joints
        left: (K, T, R) one vector per pair, sample and measured row
        right: (K, P) fictitious standard parameters

        Returns
        -------
        gq, gv, ga, each (T, n)
        """
        robot = self.robot
        states = list(
            zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)
        )
        total = np.zeros((3, len(q), self._model.nv))
        for weight, inertias in self._passes(left, right):
            self._add_pass(total, states, weight, inertias.reshape(-1, 10))
        gq, gv, ga = (robot.gathered(part[:, robot.tree.moved]) for part in total)
        return gq, gv, ga

    def _passes(self, left: Array, right: Array) -> Iterator[tuple[Array, Array]]:
        """Weights (T, nv) and standard parameters (P,) of each RNEA-derivatives pass."""
        reference = np.tile(_REFERENCE, self.robot.n_bodies)
        direction = reference if self._silent is None else self._silent
        # Twice the largest entry: the shifted masses stay well away from zero.
        least = np.abs(direction[::10]).min()
        shift = (2.0 * np.abs(right).max(axis=1) + 1e-300) / least
        weights = np.zeros((*left.shape[:2], self._model.nv))
        for weight, rows in zip(weights, left, strict=True):
            weight[:, self.robot.tree.rows] = self.robot.spread_rows(rows)
        yield from zip(weights, right + shift[:, None] * direction, strict=True)
        if self._silent is None:
            yield -np.einsum("k,ktr->tr", shift, weights), reference

    def _add_pass(self, total: Array, states: list, weight: Array, inertias: Array) -> None:
        model, data, compute = self._model, self._data, pin.computeRNEADerivatives
        for body, parameters in enumerate(inertias, start=1):
            model.inertias[body] = pin.Inertia.FromDynamicParameters(parameters)
        by_q = np.empty((len(states), model.nv, model.nv))
        by_v, by_a = np.empty_like(by_q), np.empty_like(by_q)
        view_q, view_v, view_a = data.dtau_dq, data.dtau_dv, data.M
        for t, (qt, vt, at) in enumerate(states):
            compute(model, data, qt, vt, at)
            by_q[t] = view_q
            by_v[t] = view_v
            by_a[t] = view_a
        row = weight[:, None, :]
        total[0] += (row @ by_q)[:, 0]
        total[1] += (row @ by_v)[:, 0]
        # Pinocchio fills only the upper triangle of the mass matrix.
        upper = np.triu(by_a)
        total[2] += (row @ upper)[:, 0] + (upper @ weight[:, :, None])[:, :, 0]
        total[2] -= weight * np.einsum("tii->ti", by_a)


def _shifts_every_mass(direction: Array) -> bool:
    masses = np.abs(direction[::10])
    return bool(masses.min() > 0.05 * np.abs(direction).max())
