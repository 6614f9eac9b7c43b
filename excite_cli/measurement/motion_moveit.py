"""Motions as JSON of moveit_msgs/msg/RobotTrajectory, or of a JointTrajectory alone."""

import json
from pathlib import Path

from excite_cli.errors import FileError
from excite_cli.measurement.joint_trajectory import motion_of
from excite_cli.measurement.motion_reader import MotionReader, text_of
from excite_cli.measurement.timed_motion import TimedMotion


class MotionMoveit(MotionReader):
    """`.json`."""

    title = "MoveIt JSON"
    suffixes = (".json",)

    def read(self, path: Path) -> TimedMotion:
        """The field `joint_trajectory`, if there is one, else the whole."""
        try:
            tree = json.loads(text_of(path))
        except (ValueError, RecursionError) as error:
            raise FileError(f"{path} is not valid JSON: {error}.") from error
        if isinstance(tree, dict) and "joint_trajectory" in tree:
            tree = tree["joint_trajectory"]
        return motion_of(path, tree)
