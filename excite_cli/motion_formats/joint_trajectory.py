"""The message trajectory_msgs/msg/JointTrajectory as a tree of dictionaries and lists.

Its text forms (YAML of `ros2 topic pub`, JSON of MoveIt's RobotTrajectory) and the message in a bag
have the same fields. `time_from_start` counts whole nanoseconds.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.reader import check_values
from excite_cli.motion_formats.timed_motion import TimedMotion

MAX_TEXT = 200 * 10**6  # bytes of a text file that is held in memory as a tree
_LONGEST = 10**12  # of whole seconds or nanoseconds
_NANO = 10**9  # in a second
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


def joint_trajectory(motion: TimedMotion) -> dict[str, Any]:
    """The message as dictionaries and lists, every field of its definition in order."""
    stamps = np.rint(motion.t * _NANO).astype(np.int64).tolist()
    rows = zip(stamps, *(x.tolist() for x in motion.states), strict=True)
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(motion.joint_names),
        "points": [
            {
                "positions": q,
                "velocities": v,
                "accelerations": a,
                "effort": [],
                "time_from_start": {"sec": stamp // _NANO, "nanosec": stamp % _NANO},
            }
            for stamp, q, v, a in rows
        ],
    }


def text_of(path: Path) -> str:
    """The text of a file of limited size.

    Raises
    ------
    FileError
        It is too large, no text in UTF-8, or cannot be read.
    """
    try:
        if path.stat().st_size > MAX_TEXT:
            raise FileError(
                f"{path} is larger than {MAX_TEXT // 10**6} MB. Take CSV or .npz for so long a "
                "motion."
            )
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{path} is not a text in UTF-8: {error}.") from error
