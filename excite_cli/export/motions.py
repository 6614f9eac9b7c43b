"""All motion formats by the name on the command line."""

import csv
import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from excite_cli.export.motion_exporter import MotionExporter, joint_trajectory, states_of
from excite_cli.export.motion_rosbag2 import McapExporter, Rosbag2Exporter
from excite_cli.measurement.motion_csv import CHANNELS
from excite_cli.measurement.timed_motion import TimedMotion

# YAML of a JointTrajectory message, for `ros2 topic pub` and action goals.
#
# Written line by line: numbers with all their digits, and in the form that YAML 1.1 takes for
# numbers (`1.0e-05`; it reads `1e-05` as a word).


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


# CSV: `t, q_<joint>, …, dq_<joint>, …, ddq_<joint>, …`, all digits of every number.


class CsvExporter(MotionExporter):
    """Text that spreadsheets, and this program, read to the same numbers."""

    name, suffix = "csv", ".csv"

    def _write(self, path: Path, motion: TimedMotion) -> None:
        names = [f"{channel}_{joint}" for channel in CHANNELS for joint in motion.joint_names]
        rows = np.column_stack([motion.t, *states_of(motion)]).tolist()
        with path.open("w", encoding="utf-8", newline="\n") as file:
            csv.writer(file, lineterminator="\n").writerow(["t", *names])
            file.writelines(",".join(map(repr, row)) + "\n" for row in rows)


# JSON of moveit_msgs/msg/RobotTrajectory: the joints' trajectory, and none of floating joints.


class MoveitExporter(MotionExporter):
    """`.json`, as MoveIt's Python and web tools exchange plans."""

    name, suffix = "moveit", ".json"
    whole_nanoseconds = True

    def _write(self, path: Path, motion: TimedMotion) -> None:
        joints = joint_trajectory(motion)
        others = {"header": joints["header"], "joint_names": [], "points": []}
        tree = {"joint_trajectory": joints, "multi_dof_joint_trajectory": others}
        text = json.dumps(tree, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")


# NumPy archive: t (T,), q, v, a (T, n), joint_names (n,); numbers and text, no pickles.


class NpzExporter(MotionExporter):
    """`.npz`."""

    name, suffix = "npz", ".npz"

    def _write(self, path: Path, motion: TimedMotion) -> None:
        q, v, a = states_of(motion)
        names = np.array(motion.joint_names, dtype=np.str_)
        with path.open("wb") as file:
            np.savez_compressed(file, t=motion.t, q=q, v=v, a=a, joint_names=names)


MOTION_EXPORTERS: dict[str, MotionExporter] = {
    exporter.name: exporter
    for exporter in (
        CsvExporter(),
        Ros2Exporter(),
        Rosbag2Exporter(),
        McapExporter(),
        MoveitExporter(),
        NpzExporter(),
    )
}
