"""The shapes of a robot in its posture, as a report draws them."""

import numpy as np

from excite_cli.geometry.link_meshes import Poses
from excite_cli.report.robot_faces import Faces
from excite_cli.robot.model import Robot
from excite_cli.view.geometry import robot_bodies

_DETAIL = 1 / 35  # of the robot's size


def faces_of(robot: Robot) -> Faces | None:
    """Its visual shapes, without small detail; None where there are none."""
    poses = Poses.of(robot, robot.posture[None])
    reach = float(np.ptp(poses.translations[0], axis=0).max()) or 1.0
    bodies = robot_bodies(robot, _DETAIL * reach)[0]
    corners = [
        poses.points(body.joint, body.surface.points)[0][body.surface.faces] for body in bodies
    ]
    if not any(len(each) for each in corners):
        return None
    joints = np.repeat([_mover(robot, body.joint) for body in bodies], [len(c) for c in corners])
    return Faces(np.concatenate(corners), joints)


def _mover(robot: Robot, joint: int) -> int:
    """The moved joint that carries a joint of the model; how many there are if none does."""
    own = [int(each) for each in robot.model_joints]
    while joint > 0 and joint not in own:
        joint = int(robot.model.parents[joint])
    return own.index(joint) if joint > 0 else robot.n
