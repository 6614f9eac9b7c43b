"""Where a robot's joints are in its posture: enough to draw it without its URDF."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

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
