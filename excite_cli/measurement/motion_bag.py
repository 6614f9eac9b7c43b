"""Motions in ROS bags: one JointTrajectory message, decoded with the library's own definition."""

from pathlib import Path
from typing import Any

from excite_cli.errors import ExciteError, FileError, MissingExtraError
from excite_cli.measurement.bag_reader import check_bag
from excite_cli.measurement.joint_trajectory import motion_of
from excite_cli.measurement.motion_reader import MotionReader
from excite_cli.measurement.timed_motion import TimedMotion

MESSAGE = "trajectory_msgs/msg/JointTrajectory"
_LISTS = ("positions", "velocities", "accelerations")


class MotionBag(MotionReader):
    """rosbag2: a folder with its metadata, or one `.db3` or `.mcap`."""

    title = "rosbag2"
    suffixes = (".db3", ".mcap")

    def recognises(self, path: Path, measured: tuple[str, ...] = ("tau",)) -> bool:
        """Whether it is a bag, and holds a JointTrajectory; others are measured data."""
        folder = path.is_dir() and (path / "metadata.yaml").is_file()
        if not folder and not super().recognises(path):
            return False
        try:
            check_bag(path)
            with _opened(path) as reader:
                return any(connection.msgtype == MESSAGE for connection in reader.connections)
        except MissingExtraError:
            raise
        except Exception:  # a damaged bag: the reader of measured data tells what is wrong
            return False

    def read(self, path: Path) -> TimedMotion:
        """The only message of that type."""
        check_bag(path)
        try:
            with _opened(path) as reader:
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


def _opened(path: Path) -> Any:
    try:
        from rosbags.rosbag2 import Reader
    except ImportError as error:
        raise MissingExtraError(
            "ROS bags need the library rosbags: pip install 'excite-cli[bags]'"
        ) from error
    return Reader(path)


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
