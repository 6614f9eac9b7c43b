"""A rosbag2 with one JointTrajectory message, ready for `ros2 bag play`.

It is decoded with the library's own definition, whatever the bag says of its types.
"""

import errno
import sqlite3
from pathlib import Path
from typing import Any, Literal

import numpy as np

from excite_cli.atomic import write_folder_atomically
from excite_cli.errors import ExciteError, FileError, MissingExtraError, optional_module
from excite_cli.measurement.bag_reader import check_bag
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.joint_trajectory import joint_trajectory, motion_of
from excite_cli.motion_formats.timed_motion import TimedMotion

MESSAGE = "trajectory_msgs/msg/JointTrajectory"
TOPIC = "/joint_trajectory"
_VERSION: Literal[8] = 8  # of the metadata: what ROS 2 from Humble on reads
_LISTS = ("positions", "velocities", "accelerations")


class Rosbag2(MotionFormat):
    """A folder with metadata and an SQLite file, or that file alone."""

    name, title = "rosbag2", "rosbag2"
    suffixes = (".db3",)
    whole_nanoseconds = True
    folder = True
    storage = "SQLITE3"

    def recognises(self, path: Path, measured: tuple[str, ...] = ("tau",)) -> bool:
        """Whether it is a bag, and holds a JointTrajectory; others are measured data."""
        if not is_bag(path) and not super().recognises(path):
            return False
        try:
            check_bag(path)
            with _library().Reader(path) as reader:
                return any(connection.msgtype == MESSAGE for connection in reader.connections)
        except MissingExtraError:
            raise
        except Exception:  # a damaged bag: the reader of measured data tells what is wrong
            return False

    def may_replace(self, path: Path) -> bool:
        """A folder with metadata."""
        return is_bag(path)

    def read(self, path: Path) -> TimedMotion:
        """The only message of that type."""
        check_bag(path)
        try:
            with _library().Reader(path) as reader:
                tree = _only_message(path, reader)
        except ExciteError:
            raise
        # The library lets pass whatever damaged bytes lead to; all of it means the same.
        except Exception as error:
            raise FileError(
                f"{path} is a damaged or cut off bag ({type(error).__name__}: "
                f"{str(error).strip()[:200]})."
            ) from error
        return motion_of(path, tree)

    def write(self, path: Path, motion: TimedMotion) -> None:
        """Write the bag beside, then put it in place of an earlier one."""
        _library()
        if path.exists() and not is_bag(path):
            raise FileError(f"{path} exists and is not a bag. Give another name.")
        write_folder_atomically(path, lambda temporary: self.fill(temporary, motion))

    def fill(self, path: Path, motion: TimedMotion) -> None:
        """One message, at time 0."""
        from rosbags.typesys import Stores, get_typestore

        rosbag2 = _library()
        store = get_typestore(Stores.ROS2_HUMBLE)
        message = store.serialize_cdr(message_of(store, joint_trajectory(motion)), MESSAGE)
        plugin = rosbag2.StoragePlugin[self.storage]
        try:
            with rosbag2.Writer(path, version=_VERSION, storage_plugin=plugin) as writer:
                connection = writer.add_connection(TOPIC, MESSAGE, typestore=store)
                writer.write(connection, 0, message)
        except sqlite3.Error as error:  # what SQLite says of a disk that refuses
            number = errno.ENOSPC if "full" in str(error) else errno.EIO
            raise OSError(number, str(error)) from error


class Mcap(Rosbag2):
    """A folder with metadata and an MCAP file, or that file alone."""

    name, title = "mcap", "rosbag2 of MCAP"
    suffixes = (".mcap",)
    storage = "MCAP"


def is_bag(path: Path) -> bool:
    """Whether `path` is the folder of a rosbag2."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def message_of(store: Any, tree: dict[str, Any]) -> Any:
    """The message of `store` (a rosbags typestore) with the fields of `tree`."""
    types = store.types
    duration, point = types["builtin_interfaces/msg/Duration"], types[f"{MESSAGE}Point"]
    header, stamp = tree["header"], tree["header"]["stamp"]
    lists = ("positions", "velocities", "accelerations", "effort")
    return types[MESSAGE](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](**stamp), frame_id=header["frame_id"]
        ),
        joint_names=tree["joint_names"],
        points=[
            point(
                **{name: np.array(each[name], dtype=np.float64) for name in lists},
                time_from_start=duration(**each["time_from_start"]),
            )
            for each in tree["points"]
        ],
    )


def _library() -> Any:
    return optional_module(
        "rosbags.rosbag2", "ROS bags need the library rosbags: pip install 'excite-cli[bags]'"
    )


def _only_message(path: Path, reader: Any) -> dict[str, Any]:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    chosen = [connection for connection in reader.connections if connection.msgtype == MESSAGE]
    count = sum(connection.msgcount for connection in chosen)
    if count != 1:
        topics = ", ".join(sorted({connection.topic for connection in chosen})) or "none"
        raise FileError(
            f"{path} holds {count} JointTrajectory messages (topics: {topics}); one is read as a "
            "motion. Put the one you mean into a bag of its own."
        )
    _, _, data = next(iter(reader.messages(connections=chosen)))
    return _tree(store.deserialize_cdr(data, MESSAGE))


def _tree(message: Any) -> dict[str, Any]:
    """The message as plain lists and dictionaries."""
    points = [
        {
            **{field: getattr(point, field).tolist() for field in _LISTS},
            "time_from_start": {
                "sec": int(point.time_from_start.sec),
                "nanosec": int(point.time_from_start.nanosec),
            },
        }
        for point in message.points
    ]
    return {"joint_names": list(message.joint_names), "points": points}
