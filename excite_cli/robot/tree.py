"""The robot's kinematic tree as plain records: what another dynamics engine needs to rebuild it."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

# Where a robot's joints are in its posture: enough to draw it without its URDF.

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Skeleton:
    """Places [m] in the robot's posture, z upwards.

    `base`, `joints` (n) in the order of the moved joints, `parents` (n) of each the joint before
    it, −1 for the base; `tips` (n): of the last joint of a chain the farthest frame that it moves,
    of others the joint itself.
    """

    base: Point
    joints: tuple[Point, ...]
    parents: tuple[int, ...]
    tips: tuple[Point, ...]

    def fits(self, n: int) -> bool:
        """Whether it has n joints, all in known places."""
        counts = {len(self.joints), len(self.parents), len(self.tips)}
        finite = np.isfinite([self.base, *self.joints, *self.tips]).all()
        return counts == {n} and bool(finite) and all(-1 <= k < n for k in self.parents)


def skeleton_of(robot: Robot) -> Skeleton:
    """The robot in its posture."""
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, robot.configurations(robot.posture[None])[0])
    first, own = robot.first_joint, {joint: j for j, joint in enumerate(robot.model_joints)}
    places = [np.array(data.oMi[joint].translation) for joint in own]
    parents, tips = robot.parents, list(places)
    for index, frame in enumerate(model.frames):
        j = own.get(int(frame.parentJoint), -1)
        if j < 0 or j in parents:
            continue
        at = np.array(data.oMf[index].translation)
        if np.linalg.norm(at - places[j]) > np.linalg.norm(tips[j] - places[j]):
            tips[j] = at
    base = np.array(data.oMi[first - 1].translation) if first > 0 else np.zeros(3)
    return Skeleton(_point(base), tuple(map(_point, places)), parents, tuple(map(_point, tips)))


def _point(x: Array) -> Point:
    return float(x[0]), float(x[1]), float(x[2])


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
