from dataclasses import dataclass, field
from typing import ClassVar

from control_msgs.msg import JointTolerance
from rclpy.duration import Stamp
from trajectory_msgs.msg import JointTrajectory


@dataclass
class _Goal:
    trajectory: JointTrajectory = field(default_factory=JointTrajectory)
    path_tolerance: list[JointTolerance] = field(default_factory=list)
    goal_tolerance: list[JointTolerance] = field(default_factory=list)
    goal_time_tolerance: Stamp = field(default_factory=Stamp)


@dataclass
class _Result:
    SUCCESSFUL: ClassVar = 0
    PATH_TOLERANCE_VIOLATED: ClassVar = -4
    error_code: int = 0
    error_string: str = ""


class FollowJointTrajectory:
    Goal, Result = _Goal, _Result
