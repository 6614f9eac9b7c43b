"""YAML of a JointTrajectory message, for `ros2 topic pub` and action goals.

Written line by line: numbers with all their digits, and in the form that YAML 1.1 takes for numbers
(`1.0e-05`; it reads `1e-05` as a word).
"""

import json
from collections.abc import Iterable
from pathlib import Path

from excite_cli.export.motion_exporter import MotionExporter, joint_trajectory
from excite_cli.measurement.timed_motion import TimedMotion


class Ros2Exporter(MotionExporter):
    """`ros2 topic pub --once /topic trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`."""

    name, suffix = "ros2", ".yaml"
    whole_nanoseconds = True

    def _write(self, path: Path, motion: TimedMotion) -> None:
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
