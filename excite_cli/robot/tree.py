"""The robot's kinematic tree as plain records: what another dynamics engine needs to rebuild it."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

_WORLD = -1


@dataclass(frozen=True)
class TreeJoint:
    """A joint that moves: its frame in the parent's, and the axis it turns about or slides along.

    `parent` is the index of the joint of the tree that carries it, -1 for the world: what stands
    still (the base, held at its reference) is part of the world. `rotation` (3, 3), `position` (3,)
    [m], `axis` (3,) a unit vector in the joint's own frame. It stands at multiplier · q + offset,
    q being that of the moved joint `driver`: mostly its own.
    """

    name: str
    parent: int
    rotation: Array
    position: Array
    axis: Array
    sliding: bool
    driver: int
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Tree:
    """All joints that move, parents first, in the model's order; `gravity` (3,) [m/s²].

    `first_body`: number of bodies of φ before that of the first moved joint (a floating base's).
    """

    joints: tuple[TreeJoint, ...]
    gravity: Array
    first_body: int


def tree_of(robot: Robot) -> Tree:
    """The tree of `robot`; a floating base is held at its reference and becomes world."""
    model, coupling, robot = robot.model, robot.coupling, robot.tree
    data = model.createData()
    first = robot.first_joint
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
        follows = (j, 1.0, 0.0)
        if coupling is not None:
            follows = (int(coupling.driver[j]), float(coupling.multiplier[j]),
                       float(coupling.offset[j]))  # fmt: skip
        joints.append(
            TreeJoint(
                name=robot.joint_names[j],
                parent=parent - first if parent >= first else _WORLD,
                rotation=np.array(placement.rotation),
                position=np.array(placement.translation),
                axis=axis[:3] if sliding else axis[3:],
                sliding=sliding,
                driver=follows[0],
                multiplier=follows[1],
                offset=follows[2],
            )
        )
    return Tree(tuple(joints), np.array(model.gravity.linear), first - 1)


def _axis(robot: Robot, data: pin.Data, j: int) -> Array:
    """Motion of body j in its own frame when only joint j moves at unit speed (6,)."""
    velocity = np.zeros(robot.model.nv)
    velocity[robot.moved[j]] = 1.0
    pin.forwardKinematics(robot.model, data, robot.reference, velocity)
    motion = data.v[robot.first_joint + j]
    return np.concatenate([motion.linear, motion.angular])
