"""Frames at which wrenches act on the robot, and what these do to all of its joints."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True, eq=False)
class ContactFrame:
    """The frame of a wrench that acts on the body of moved `joint`.

    `rotation` (3, 3) and `position` (3,) [m] stand in the joint's frame, or are fixed `in_world`.
    """

    joint: int
    rotation: Array
    position: Array
    in_world: bool = False


def contact_jacobians(
    robot: Robot, frames: Sequence[ContactFrame], q: Array
) -> Iterator[list[Array]]:
    """At every posture of q (T, n), for every frame J (6, n) in axes of its own.

    Jᵀ w is what a wrench w = [force; moment] that acts on the robot there does to all joints.
    """
    model, moved = robot.model, robot.tree.moved
    data, aligned = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for posture in robot.configurations(q):
        pin.computeJointJacobians(model, data, posture)
        found = []
        for frame in frames:
            joint = robot.model_joints[frame.joint]
            place = data.oMi[joint]
            whole = pin.getJointJacobian(model, data, joint, aligned).reshape(6, -1)
            jacobian = robot.gathered(whole[:, moved])
            axes, point = frame.rotation, frame.position
            if not frame.in_world:
                axes, point = place.rotation @ axes, place.act(point)
            linear = jacobian[:3] - pin.skew(point - place.translation) @ jacobian[3:]
            found.append(np.vstack([axes.T @ linear, axes.T @ jacobian[3:]]))
        yield found


def readings(
    robot: Robot, joint: int, place: tuple[Array, Array], states: tuple[Array, Array, Array],
    gravity: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Rates ω (T, 3) [rad/s] and specific forces p̈ − g (T, 3) [m/s²], in axes of the unit.

    `place`: rotation (3, 3) and position (3,) of the unit in the frame of moved `joint`; `states`
    q, v, a (T, n); `gravity` (3,) of the world.
    """
    rotation, lever = place
    model, body = robot.model, robot.model_joints[joint]
    data = model.createData()
    rates, forces = np.empty((2, len(states[0]), 3))
    full = robot.configurations(states[0]), *map(robot.velocities, states[1:])
    for t, (q, v, a) in enumerate(zip(*full, strict=True)):
        pin.forwardKinematics(model, data, q, v, a)
        twist, gained = data.v[body], data.a[body]
        turning = np.cross(twist.angular, lever)
        at = gained.linear + np.cross(twist.angular, twist.linear + turning)
        rates[t] = twist.angular
        forces[t] = at + np.cross(gained.angular, lever) - data.oMi[body].rotation.T @ gravity
    return rates @ rotation, forces @ rotation
