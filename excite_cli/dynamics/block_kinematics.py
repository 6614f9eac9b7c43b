"""Motion of every body and its derivative, by forward recursion over the kinematic tree.

The block form of the regressor needs, per body j, the vectors of Eq. 24 in world axes,
ξ_j = [p̈_j, ω̇_j, ω_j] with gravity in p̈ (p̈_0 = −g), and ∂ξ_j/∂x for x = [q, q̇, q̈], for which the
paper refers to [22]. Quantities without index are those of the parent λ of j, z is the joint axis
and d = p_j − p_λ:

    revolute    ω_j = ω + z q̇    ω̇_j = ω̇ + z q̈ + ω × z q̇    p̈_j = p̈ + ω̇ × d + ω × (ω × d)
    prismatic   ω_j = ω          ω̇_j = ω̇                     p̈_j = … + z q̈ + 2 ω × z q̇

z and the constant part of d are fixed in the parent, so ∂z/∂q = −[z×] J_W and ∂d/∂q = −[d×] J_W
(plus z in a prismatic joint's own column), with J_W the angular half of the parent's basic
Jacobian; the product rule gives the rest, exactly.

Only placements, axes and parents are taken from the Pinocchio model, none of its algorithms, so
that the result can judge them. All samples go through at once; the loop is over bodies.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class Joint:
    """What the model stores of one joint.

    `rotation` (3, 3) and `translation` (3,) place it in its parent; `subspace` (6, nv) is
    [linear; angular] in the joint frame, its transpose is the paper's K. `column` is its place in
    q, or None where the body does not move in its parent (world, base).
    """

    parent: int
    rotation: Array
    translation: Array
    subspace: Array
    first_dof: int
    column: int | None

    @property
    def revolute(self) -> bool:
        """Whether the joint turns; otherwise it slides (or does not move at all)."""
        return self.column is not None and bool(self.subspace[3:].any())


@dataclass(frozen=True)
class BlockMotion:
    """One body over T samples, in world axes.

    `position` [m], `velocity` ω [rad/s], `angular` ω̇ [rad/s²] and `linear` p̈ (gravity included)
    [m/s²] are (T, 3), `rotation` is (T, 3, 3); `axis` z and `offset` d (T, 3) are those of the
    joint that carries the body, `rate` q̇ and `acceleration` q̈ (T, 1) its own.
    """

    position: Array
    rotation: Array
    velocity: Array
    angular: Array
    linear: Array
    axis: Array
    offset: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True)
class BodyJacobians:
    """Derivatives of one body's motion over T samples, in world axes.

    `basic` J_B (T, 6, n) with [ṗ; ω] = J_B q̇; `velocity`, `angular`, `linear` (T, 3, 3n) are the
    derivatives of ω, ω̇, p̈ with respect to x = [q, q̇, q̈].
    """

    basic: Array
    velocity: Array
    angular: Array
    linear: Array


def skew(x: Array) -> Array:
    """[x×] of Eq. 54: (..., 3) → (..., 3, 3)."""
    result = np.zeros((*x.shape, 3))
    result[..., 0, 1], result[..., 0, 2], result[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    result[..., 1, 0], result[..., 2, 0], result[..., 2, 1] = x[..., 2], -x[..., 1], x[..., 0]
    return result


def joints_of(robot: Robot) -> list[Joint]:
    """The joints in the model's order; index 0 is the world."""
    model = robot.model
    world = Joint(0, np.eye(3), np.zeros(3), np.zeros((6, 0)), 0, None)
    joints = [world]
    for index in range(1, model.njoints):
        stored, placement = model.joints[index], model.jointPlacements[index]
        rotation, translation = placement.rotation.copy(), placement.translation.copy()
        base = robot.floating and index == 1
        if base:
            translation = translation + rotation @ robot.reference[:3]
            rotation = rotation @ _quaternion_matrix(robot.reference[3:7])
        joints.append(
            Joint(
                parent=int(model.parents[index]),
                rotation=rotation,
                translation=translation,
                subspace=np.array(stored.createData().S).reshape(6, stored.nv),
                first_dof=int(stored.idx_v),
                column=None if base else int(stored.idx_v) - (6 if robot.floating else 0),
            )
        )
    return joints


def body_motions(
    robot: Robot, joints: list[Joint], q: Array, v: Array, a: Array
) -> list[BlockMotion]:
    """Motion of the world (index 0) and of every body, in the order of `joints`.

    Parameters
    ----------
    q, v, a: (T, n) of the moved joints [rad, rad/s, rad/s²; m for prismatic joints]
    """
    zero, none = np.zeros((len(q), 3)), np.zeros((len(q), 1))
    gravity = zero - np.asarray(robot.model.gravity.linear)
    upright = np.tile(np.eye(3), (len(q), 1, 1))
    motions = [BlockMotion(zero, upright, zero, zero, gravity, zero, zero, none, none)]
    for joint in joints[1:]:
        column = joint.column
        rates = (none, none, none)
        if column is not None:
            rates = (q[:, column, None], v[:, column, None], a[:, column, None])
        motions.append(_carried(motions[joint.parent], joint, *rates))
    return motions


def _carried(parent: BlockMotion, joint: Joint, q: Array, v: Array, a: Array) -> BlockMotion:
    """Motion of the body that `joint` carries, from its parent's."""
    offset = parent.rotation @ joint.translation
    rotation = parent.rotation @ joint.rotation
    velocity, angular, axis = parent.velocity, parent.angular, np.zeros_like(offset)
    sliding = axis
    if joint.revolute:
        local = joint.subspace[3:, 0]
        axis = rotation @ local
        rotation = rotation @ _axis_rotation(local, q)
        velocity = parent.velocity + axis * v
        angular = parent.angular + axis * a + np.cross(parent.velocity, axis * v)
    elif joint.column is not None:
        axis = rotation @ joint.subspace[:3, 0]
        offset = offset + axis * q
        sliding = axis * a + 2 * np.cross(parent.velocity, axis * v)
    centripetal = np.cross(parent.velocity, np.cross(parent.velocity, offset))
    return BlockMotion(
        position=parent.position + offset,
        rotation=rotation,
        velocity=velocity,
        angular=angular,
        linear=parent.linear + np.cross(parent.angular, offset) + centripetal + sliding,
        axis=axis,
        offset=offset,
        rate=v,
        acceleration=a,
    )


def body_jacobians(joints: list[Joint], motions: list[BlockMotion], n: int) -> list[BodyJacobians]:
    """Derivatives of every body's motion, in the order of `joints`; `n` moved joints."""
    count = len(motions[0].position)
    zero = np.zeros((count, 3, 3 * n))
    jacobians = [BodyJacobians(np.zeros((count, 6, n)), zero, zero, zero)]
    for joint, motion in zip(joints[1:], motions[1:], strict=True):
        parent = motions[joint.parent]
        jacobians.append(_carried_jacobians(parent, jacobians[joint.parent], joint, motion))
    return jacobians


def _carried_jacobians(
    parent: BlockMotion, given: BodyJacobians, joint: Joint, motion: BlockMotion
) -> BodyJacobians:
    """Product rule on `_carried`, with `given` the parent's derivatives."""
    if joint.column is None:
        return given
    n = given.basic.shape[2]
    by_rate, by_acceleration = n + joint.column, 2 * n + joint.column
    spin = skew(parent.velocity)
    d_axis = -skew(motion.axis) @ given.basic[:, 3:]
    d_offset = -skew(motion.offset) @ given.basic[:, 3:]
    # ∂(z q̇) and ∂(z q̈), then ∂(ω × z q̇)
    d_rate = np.zeros_like(given.velocity)
    d_rate[:, :, :n] = d_axis * motion.rate[:, None]
    d_rate[:, :, by_rate] = motion.axis
    d_acceleration = np.zeros_like(given.velocity)
    d_acceleration[:, :, :n] = d_axis * motion.acceleration[:, None]
    d_acceleration[:, :, by_acceleration] = motion.axis
    d_coriolis = spin @ d_rate - skew(motion.axis * motion.rate) @ given.velocity
    velocity, angular = given.velocity, given.angular
    basic = given.basic.copy()
    if joint.revolute:
        velocity, angular = velocity + d_rate, angular + d_acceleration + d_coriolis
        basic[:, 3:, joint.column] += motion.axis
    else:
        d_offset[:, :, joint.column] += motion.axis
    basic[:, :3] += d_offset
    # ∂(ω̇ × d + ω × (ω × d))
    arm = skew(motion.offset)
    whirl = skew(np.cross(parent.velocity, motion.offset)) + spin @ arm
    linear = given.linear - arm @ given.angular - whirl @ given.velocity
    linear[:, :, :n] += (skew(parent.angular) + spin @ spin) @ d_offset
    if not joint.revolute:
        linear += d_acceleration + 2 * d_coriolis
    return BodyJacobians(basic, velocity, angular, linear)


def _axis_rotation(axis: Array, angle: Array) -> Array:
    """Rotations (T, 3, 3) by `angle` (T, 1) [rad] about the unit `axis` (3,) (Rodrigues)."""
    cross, turn = skew(axis), angle[:, :, None]
    rotation: Array = np.eye(3) + np.sin(turn) * cross + (1 - np.cos(turn)) * (cross @ cross)
    return rotation


def _quaternion_matrix(xyzw: Array) -> Array:
    cross = skew(xyzw[:3])
    matrix: Array = np.eye(3) + 2 * xyzw[3] * cross + 2 * cross @ cross
    return matrix
