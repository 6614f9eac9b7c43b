"""A rosbag2 with one JointTrajectory message, ready for `ros2 bag play`."""

import errno
import sqlite3
from pathlib import Path
from typing import Any, Literal

import numpy as np

from excite_cli.atomic import write_folder_atomically
from excite_cli.errors import FileError, MissingExtraError
from excite_cli.export.motion_exporter import MotionExporter, joint_trajectory
from excite_cli.measurement.motion_bag import MESSAGE
from excite_cli.measurement.timed_motion import TimedMotion

TOPIC = "/joint_trajectory"
_VERSION: Literal[8] = 8  # of the metadata: what ROS 2 from Humble on reads


class Rosbag2Exporter(MotionExporter):
    """A folder with metadata and an SQLite file."""

    name, suffix = "rosbag2", ""
    whole_nanoseconds = True
    folder = True
    storage = "SQLITE3"

    def write(self, path: Path, motion: TimedMotion) -> None:
        """Write the bag beside, then put it in place of an earlier one."""
        _require_rosbags()
        if path.exists() and not is_bag(path):
            raise FileError(f"{path} exists and is not a bag. Give another name.")
        write_folder_atomically(path, lambda temporary: self._write(temporary, motion))

    def _write(self, path: Path, motion: TimedMotion) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        message = store.serialize_cdr(message_of(store, joint_trajectory(motion)), MESSAGE)
        plugin = StoragePlugin[self.storage]
        try:
            with Writer(path, version=_VERSION, storage_plugin=plugin) as writer:
                connection = writer.add_connection(TOPIC, MESSAGE, typestore=store)
                writer.write(connection, 0, message)
        except sqlite3.Error as error:  # what SQLite says of a disk that refuses
            number = errno.ENOSPC if "full" in str(error) else errno.EIO
            raise OSError(number, str(error)) from error


class McapExporter(Rosbag2Exporter):
    """A folder with metadata and an MCAP file."""

    name = "mcap"
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


def _require_rosbags() -> None:
    try:
        import rosbags.rosbag2  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            "Writing ROS bags needs the library rosbags: pip install 'excite-cli[bags]'"
        ) from error
