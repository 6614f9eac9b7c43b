"""The robot's kinematic tree as plain records: what another dynamics engine needs to rebuild it."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

_WORLD = -1


@dataclass(frozen=True)
class TreeJoint:
    """A moved joint: its frame in the parent's frame, and the axis it turns about or slides along.

    `parent` is the index of the moved joint that carries it, -1 for the world: what stands still
    (the base, held at its reference) is part of the world. `rotation` (3, 3), `position` (3,) [m],
    `axis` (3,) a unit vector in the joint's own frame.
    """

    name: str
    parent: int
    rotation: Array
    position: Array
    axis: Array
    sliding: bool


@dataclass(frozen=True)
class Tree:
    """All moved joints in the robot's order, parents first; `gravity` (3,) [m/s²] in the world.

    `first_body`: number of bodies of φ before that of the first moved joint (a floating base's).
    """

    joints: tuple[TreeJoint, ...]
    gravity: Array
    first_body: int


def tree_of(robot: Robot) -> Tree:
    """The tree of `robot`; a floating base is held at its reference and becomes world."""
    model = robot.model
    data = model.createData()
    first = model.njoints - robot.n
    pin.forwardKinematics(model, data, robot.reference)
    places = [data.oMi[j].copy() for j in range(model.njoints)]
    joints = []
    for j in range(robot.n):
        joint = first + j
        parent = int(model.parents[joint])
        placement = model.jointPlacements[joint]
        if parent < first:
            placement = places[parent] * placement
        axis = _axis(robot, data, j)
        sliding = bool(robot.sliding[j])
        joints.append(
            TreeJoint(
                name=robot.joint_names[j],
                parent=parent - first if parent >= first else _WORLD,
                rotation=np.array(placement.rotation),
                position=np.array(placement.translation),
                axis=axis[:3] if sliding else axis[3:],
                sliding=sliding,
            )
        )
    return Tree(tuple(joints), np.array(model.gravity.linear), first - 1)


def _axis(robot: Robot, data: pin.Data, j: int) -> Array:
    """Motion of body j in its own frame when only joint j moves at unit speed (6,)."""
    velocity = np.zeros(robot.model.nv)
    velocity[robot.moved[j]] = 1.0
    pin.forwardKinematics(robot.model, data, robot.reference, velocity)
    motion = data.v[robot.model.njoints - robot.n + j]
    return np.concatenate([motion.linear, motion.angular])
