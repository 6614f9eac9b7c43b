"""YAML of a JointTrajectory message, for `ros2 topic pub` and action goals.

Written line by line: numbers with all their digits, and in the form that YAML 1.1 takes for numbers
(`1.0e-05`; it reads `1e-05` as a word).
"""

import json
from collections.abc import Iterable
from pathlib import Path

from excite_cli.config.plain_yaml import parse_plain
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.joint_trajectory import joint_trajectory, motion_of, text_of
from excite_cli.motion_formats.timed_motion import TimedMotion


class Ros2Yaml(MotionFormat):
    """`ros2 topic pub --once /topic trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`."""

    name, title = "ros2", "ROS 2 YAML"
    suffixes = (".yaml", ".yml")
    whole_nanoseconds = True

    def read(self, path: Path) -> TimedMotion:
        """The first document of the file."""
        return motion_of(path, parse_plain(text_of(path), str(path)))

    def fill(self, path: Path, motion: TimedMotion) -> None:
        """Line by line."""
        tree = joint_trajectory(motion)
        stamp = tree["header"]["stamp"]
        with path.open("w", encoding="utf-8", newline="\n") as file:
            file.write(
                "header:\n"
                f"  stamp: {{sec: {stamp['sec']}, nanosec: {stamp['nanosec']}}}\n"
                "  frame_id: ''\n"
                f"joint_names: {json.dumps(tree['joint_names'], ensure_ascii=False)}\n"
                "points:\n"
            )
            for point in tree["points"]:
                time = point["time_from_start"]
                file.write(
                    f"- positions: {_numbers(point['positions'])}\n"
                    f"  velocities: {_numbers(point['velocities'])}\n"
                    f"  accelerations: {_numbers(point['accelerations'])}\n"
                    "  effort: []\n"
                    f"  time_from_start: {{sec: {time['sec']}, nanosec: {time['nanosec']}}}\n"
                )


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
