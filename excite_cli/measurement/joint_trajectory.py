"""The message trajectory_msgs/msg/JointTrajectory as a tree of dictionaries and lists.

Its text forms (YAML of `ros2 topic pub`, JSON of MoveIt's RobotTrajectory) and the message in a bag
have the same fields. `time_from_start` counts whole nanoseconds.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.config.plain_yaml import parse_plain
from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.motion_reader import MotionReader, text_of
from excite_cli.measurement.reader import check_values
from excite_cli.measurement.timed_motion import TimedMotion

_LONGEST = 10**12  # of whole seconds or nanoseconds
_FIELDS = ("positions", "velocities", "accelerations")
_SHAPE = "{joint_names: […], points: [{positions: […], time_from_start: {sec: …, nanosec: …}}, …]}"


def motion_of(path: Path, tree: Any) -> TimedMotion:
    """The motion of a message; `tree` is as it was read.

    Raises
    ------
    FileError
        A field is missing, or has another shape than the message asks for.
    """
    if not isinstance(tree, Mapping) or not {"joint_names", "points"} <= set(tree):
        raise FileError(f"{path} holds no JointTrajectory; expected {_SHAPE}.")
    names, points = tree["joint_names"], tree["points"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise FileError(f"{path}: joint_names must be a list of names.")
    if not isinstance(points, list) or not all(isinstance(point, Mapping) for point in points):
        raise FileError(f"{path}: points must be a list; expected {_SHAPE}.")
    check_values(path, 3 * len(points) * max(len(names), 1))
    t = np.array([_seconds(path, point, row) for row, point in enumerate(points)])
    q, v, a = (_column(path, points, field, len(names)) for field in _FIELDS)
    if q is None:
        raise FileError(f"{path}: its points have no positions.")
    return TimedMotion(path.name.split(".")[0], tuple(names), t, q, v, a)


def seconds(sec: int, nanosec: int) -> float:
    """The nearest number of seconds, from whole nanoseconds."""
    return (sec * 10**9 + nanosec) / 1e9


def _seconds(path: Path, point: Mapping[str, Any], row: int) -> float:
    stamp = point.get("time_from_start")
    if isinstance(stamp, Mapping):
        sec, nanosec = stamp.get("sec", stamp.get("secs")), stamp.get("nanosec", stamp.get("nsecs"))
        if type(sec) is int and type(nanosec) is int and max(abs(sec), abs(nanosec)) < _LONGEST:
            return seconds(sec, nanosec)
    raise FileError(
        f"{path}: point {row + 1} has no time_from_start: {{sec: …, nanosec: …}} of whole numbers."
    )


def _column(path: Path, points: list[Any], field: str, width: int) -> Array | None:
    """(T, n) of one field; None where all points leave it out."""
    rows = [point.get(field) or [] for point in points]
    sizes = {len(row) if isinstance(row, list) else -1 for row in rows}
    if sizes <= {0}:
        return None
    if sizes != {width}:
        at = next(i for i, row in enumerate(rows) if not isinstance(row, list) or len(row) != width)
        raise FileError(
            f"{path}: point {at + 1} does not have {width} {field}, one per joint. Give them in "
            "every point or in none."
        )
    try:
        return np.array(rows, dtype=float)
    except (ValueError, TypeError, OverflowError) as error:
        raise FileError(f"{path}: {field} are not all numbers: {error}.") from error


# Motions as YAML of a JointTrajectory message, as `ros2 topic pub` takes it.


class MotionRos2(MotionReader):
    """`.yaml`."""

    title = "ROS 2 YAML"
    suffixes = (".yaml", ".yml")

    def read(self, path: Path) -> TimedMotion:
        """The first document of the file."""
        return motion_of(path, parse_plain(text_of(path), str(path)))


# Motions as JSON of moveit_msgs/msg/RobotTrajectory, or of a JointTrajectory alone.


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
