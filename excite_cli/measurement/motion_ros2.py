"""Motions as YAML of a JointTrajectory message, as `ros2 topic pub` takes it."""

from pathlib import Path

from excite_cli.config.plain_yaml import parse_plain
from excite_cli.measurement.joint_trajectory import motion_of
from excite_cli.measurement.motion_reader import MotionReader, text_of
from excite_cli.measurement.timed_motion import TimedMotion


class MotionRos2(MotionReader):
    """`.yaml`."""

    title = "ROS 2 YAML"
    suffixes = (".yaml", ".yml")

    def read(self, path: Path) -> TimedMotion:
        """The first document of the file."""
        return motion_of(path, parse_plain(text_of(path), str(path)))
