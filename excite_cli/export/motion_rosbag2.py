"""A rosbag2 with one JointTrajectory message, ready for `ros2 bag play`."""

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np

from excite_cli.errors import FileError, MissingExtraError
from excite_cli.export.joint_trajectory import joint_trajectory
from excite_cli.export.motion_exporter import MotionExporter
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
            raise FileError(f"{path} is there and is no bag. Give another name.")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
                bag = Path(folder) / path.name
                self._write(bag, motion)
                if path.exists():
                    shutil.rmtree(path)
                os.replace(bag, path)
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error.strerror or error}.") from error

    def _write(self, path: Path, motion: TimedMotion) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        with Writer(path, version=_VERSION, storage_plugin=StoragePlugin[self.storage]) as writer:
            connection = writer.add_connection(TOPIC, MESSAGE, typestore=store)
            message = message_of(store, joint_trajectory(motion))
            writer.write(connection, 0, store.serialize_cdr(message, MESSAGE))


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
