"""The vector–Jacobian product of the regressor in the paper's block form: an independent reference.

Row block i (joint), column block j (body) of Y, for bodies j in the subtree of joint i
(Eqs. 18–23, 𝒴 and 𝒜 in Eqs. 57–59):

    Y_ij = K_i A_i⁻¹ A_j Y_j,    A = 𝒜(p, R),    Y_j = 𝒴(ʲp̈_j, ʲω̇_j, ʲω_j)    (gravity in p̈).

For any Z the derivative of Z_ij : Y_ij has two parts (Eq. 25). Through ʲξ_j it is
g_ij = (B_ijᵀ Z_ij) : {𝒴_A(e), 𝒴_B(e), 𝒴_C(e, ʲω_j)} with B_ij = K_i A_i⁻¹ A_j (Eqs. 26–28), times

    ∂ʲξ_j/∂x = R̂_jᵀ (∂ξ_j/∂x + [ξ_j×] J_Wj)                                      (Eq. 30).

Through A_j and A_i it is, in the layout of A (the transpose of the paper's),

    + G_ij,            G_ij = (K_i A_i⁻¹)ᵀ Z_ij Y_jᵀ                               (Eqs. 32, 34),
    − A_i⁻ᵀ Ĝ_ij A_i⁻ᵀ, Ĝ_ij = K_iᵀ Z_ij (A_j Y_j)ᵀ                                (Eqs. 33, 35),

each contracted with ∂A_k by Eq. 40. Both parts are linear, so what is common to all i is summed
before it meets ∂ʲξ_j/∂x or ∂A_k/∂x; Eq. 47 is the sum over i and j.

Misprints corrected here:
- Eq. 18, 46: the block in row i, column j is Y_ij; and Z has Y's layout, (X 𝒞 Sᵀ)ᵀ.
- Eq. 24: the first entry of ʲξ_j is ʲp̈_j.
- Eq. 28: the rows run over e_x, e_y, e_z in each of the three groups.
- Eq. 30: R̂_jᵀ stands before both terms.
- Eq. 33, 36: the inverses are of A_i; Eq. 33 also lacks its minus sign (Eq. 36 has it).
- Eq. 57: as printed it moves velocities. Six-axis forces [f; n] need [[R, 0], [[p×] R, R]]; with it
  Eqs. 39, 40 and 55 are right as printed, (ν, ω) being (f, n) and J_B ordered [ṗ; ω].
- Eq. 60–62: the four-argument 𝒴 is 𝒴̂ of Eq. 58.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.block_kinematics import (
    BlockMotion,
    Joint,
    body_jacobians,
    body_motions,
    joints_of,
    skew,
)
from excite_cli.robot.model import Array, Robot

# Eq. 56 orders inertias (Ixx, Iyy, Izz, Iyz, Izx, Ixy), Pinocchio (Ixx, Ixy, Iyy, Ixz, Iyz, Izz).
_PINOCCHIO_ORDER = [0, 5, 1, 4, 3, 2]
_UNIT, _NIL = np.eye(3), np.zeros((3, 3))


@dataclass(frozen=True)
class _RowBlock:
    """Rows of Y that belong to joint i: their places, K_i (rows, 6), and the bodies it carries."""

    joint: int
    rows: slice
    projection: Array
    subtree: tuple[int, ...]


def block_pull_back(
    robot: Robot, q: Array, v: Array, a: Array, Z: Array
) -> tuple[Array, Array, Array]:
    """Gradient of Σ_t Z_t : Y(x_t) with respect to x_t = [q_t, v_t, a_t], by Eqs. 25–40 and 47.

    Parameters
    ----------
    q, v, a: (T, n) of the moved joints [rad, rad/s, rad/s²; m for prismatic joints]
    Z: (T, R, 10·n_bodies), arbitrary

    Returns
    -------
    gq, gv, ga, each (T, n)
    """
    coupled, robot = robot, robot.tree
    q, v, a = coupled.all_positions(q), coupled.all_rates(v), coupled.all_rates(a)
    Z = coupled.spread_rows(Z)
    joints = joints_of(robot)
    motions = body_motions(robot, joints, q, v, a)
    jacobians = body_jacobians(joints, motions, robot.n)
    transforms = [force_transform(body.position, body.rotation) for body in motions]
    by_body, by_transform = _partials(robot, joints, motions, transforms, Z)
    gradient = np.zeros((len(q), 3 * robot.n))
    for k in range(1, len(joints)):
        body, jacobian = motions[k], jacobians[k]
        turned = np.swapaxes(body.rotation, 1, 2)
        local = _local(body)
        sensitivity = _by_motion(by_body[k], local[2])
        parts = zip(
            (body.linear, body.angular, body.velocity),
            (jacobian.linear, jacobian.angular, jacobian.velocity),
            (sensitivity[:, 0:3], sensitivity[:, 3:6], sensitivity[:, 6:9]),
            strict=True,
        )
        for vector, derivative, g in parts:
            # Eq. 30, read from the left: gᵀ R_jᵀ (∂ξ + [ξ×] J_W)
            row = g[:, None] @ turned
            gradient += (row @ derivative)[:, 0]
            gradient[:, : robot.n] += (row @ skew(vector) @ jacobian.basic[:, 3:])[:, 0]
        wrench = _by_placement(by_transform[k], transforms[k])
        world = np.concatenate([wrench[:, None, :3] @ turned, wrench[:, None, 3:] @ turned], axis=2)
        gradient[:, : robot.n] += (world @ jacobian.basic)[:, 0]
    gq, gv, ga = map(coupled.gathered, np.split(gradient, 3, axis=1))
    return gq, gv, ga


def _partials(
    robot: Robot, joints: list[Joint], motions: list[BlockMotion], transforms: list[Array], Z: Array
) -> tuple[Array, Array]:
    """Sums over i: B_ijᵀ Z_ij of each body (B, T, 6, 10), and ∂/∂A_k of Eq. 36 (B, T, 6, 6)."""
    inverses = [_inverse_transform(body.position, body.rotation) for body in motions]
    bodies = [rigid_body_regressor(*_local(body)) for body in motions]
    by_body = np.zeros((len(joints), len(Z), 6, 10))
    by_transform = np.zeros((len(joints), len(Z), 6, 6))
    for block in _row_blocks(robot, joints):
        i, K = block.joint, block.projection
        KA = K @ inverses[i]
        hat = np.zeros((len(Z), 6, 6))
        for j in block.subtree:
            Zij = Z[:, block.rows, 10 * (j - 1) : 10 * j]
            at_world = _transpose(KA) @ Zij
            by_body[j] += _transpose(transforms[j]) @ at_world
            by_transform[j] += at_world @ _transpose(bodies[j])
            hat += K.T @ Zij @ _transpose(transforms[j] @ bodies[j])
        inverse = _transpose(inverses[i])
        by_transform[i] -= inverse @ hat @ inverse
    return by_body, by_transform


def _by_motion(weights: Array, omega: Array) -> Array:
    """Eq. 28: derivative (T, 9) of weights : Y_j, weights (T, 6, 10), by ʲp̈, ʲω̇, ʲω."""
    by_linear = rigid_body_regressor(_UNIT, _NIL, _NIL)
    by_angular = rigid_body_regressor(_NIL, _UNIT, _NIL)
    other = omega[:, None]
    by_velocity = rigid_body_regressor(_NIL, _NIL, _UNIT, other)
    by_velocity = by_velocity + rigid_body_regressor(_NIL, _NIL, other, _UNIT)
    flat = weights.reshape(len(weights), 60, 1)
    constant = np.concatenate([by_linear, by_angular]).reshape(6, 60)
    return np.concatenate(
        [(constant @ flat)[:, :, 0], (by_velocity.reshape(-1, 3, 60) @ flat)[:, :, 0]], axis=1
    )


def _by_placement(G: Array, A: Array) -> Array:
    """Eq. 40 before J_B: derivative (T, 6) of G : A by [ṗ; ω] dt of the body, in its own axes."""
    # Σ_p (Gᵀ A)[p, :] [−e_p •̂]; both are (T, 6, 6), the operator is constant.
    product = _transpose(G) @ A
    wrench: Array = product.reshape(len(G), 36) @ _OPERATORS
    return wrench


def force_transform(p: Array, R: Array) -> Array:
    """𝒜(p, R) of Eq. 57 for forces [f; n]: (..., 6, 6)."""
    result = np.zeros((*p.shape[:-1], 6, 6))
    result[..., :3, :3] = result[..., 3:, 3:] = R
    result[..., 3:, :3] = skew(p) @ R
    return result


def _inverse_transform(p: Array, R: Array) -> Array:
    back = _transpose(R)
    return force_transform(-(back @ p[..., None])[..., 0], back)


def rigid_body_regressor(a: Array, b: Array, c: Array, c_hat: Array | None = None) -> Array:
    """𝒴̂(a, b, c, ĉ) of Eq. 58, with ĉ = c where it is not given (Eq. 59).

    Parameters
    ----------
    a, b, c, c_hat: (..., 3) acceleration, angular acceleration, angular velocity (twice)

    Returns
    -------
    (..., 6, 10), rows [force; moment], columns in Pinocchio's order
    """
    c_hat = c if c_hat is None else c_hat
    shape = np.broadcast_shapes(a.shape, b.shape, c.shape, c_hat.shape)
    result = np.zeros((*shape[:-1], 6, 10))
    cross = skew(c)
    result[..., :3, 0] = a
    result[..., :3, 1:4] = skew(b) + cross @ skew(c_hat)
    result[..., 3:, 1:4] = -skew(a)
    result[..., 3:, 4:] = _dot(b) + cross @ _dot(c_hat)
    return result


def _dot(x: Array) -> Array:
    """[x•] of Eq. 56 with Pinocchio's order of the inertias: (..., 3) → (..., 3, 6)."""
    result = np.zeros((*x.shape, 6))
    for axis in range(3):
        result[..., axis, axis] = x[..., axis]
    result[..., 0, 4], result[..., 0, 5] = x[..., 2], x[..., 1]
    result[..., 1, 3], result[..., 1, 5] = x[..., 2], x[..., 0]
    result[..., 2, 3], result[..., 2, 4] = x[..., 1], x[..., 0]
    return result[..., _PINOCCHIO_ORDER]


def _hat_dot(x: Array) -> Array:
    """[x •̂] of Eq. 55: (..., 6) → (..., 6, 6)."""
    result = np.zeros((*x.shape, 6))
    result[..., :3, 3:] = result[..., 3:, :3] = skew(x[..., :3])
    result[..., 3:, 3:] = skew(x[..., 3:])
    return result


_OPERATORS = _hat_dot(-np.eye(6)).reshape(36, 6)


def _local(body: BlockMotion) -> tuple[Array, Array, Array]:
    """ʲξ_j of Eq. 29 as ʲp̈_j, ʲω̇_j, ʲω_j, each (T, 3)."""
    back = _transpose(body.rotation)
    linear, angular, velocity = (
        (back @ x[..., None])[..., 0] for x in (body.linear, body.angular, body.velocity)
    )
    return linear, angular, velocity


def _row_blocks(robot: Robot, joints: list[Joint]) -> Iterator[_RowBlock]:
    """Measured row blocks; the subtree of joint i are the j with s_ij = 1 (Eq. 20)."""
    subtrees: list[list[int]] = [[] for _ in joints]
    for j in range(1, len(joints)):
        ancestor = j
        while ancestor > 0:
            subtrees[ancestor].append(j)
            ancestor = joints[ancestor].parent
    for i, joint in enumerate(joints):
        dofs = robot.rows - joint.first_dof
        rows = np.flatnonzero((dofs >= 0) & (dofs < joint.subspace.shape[1]))
        if len(rows):
            projection = joint.subspace[:, dofs[rows]].T
            yield _RowBlock(
                i, slice(int(rows[0]), int(rows[-1]) + 1), projection, tuple(subtrees[i])
            )


def _transpose(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)
