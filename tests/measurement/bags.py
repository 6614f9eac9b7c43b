"""Bags of joint states, and of a robot that stands: its sensors have stamps of their own."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from excite_cli.measurement.dataset import Run
from tests.measurement.recordings import JOINTS

EPOCH = 1_700_000_000_000_000_000  # ns
STATE = "sensor_msgs/msg/JointState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
IMU = "sensor_msgs/msg/Imu"
POSE = "geometry_msgs/msg/PoseStamped"
COVARIANT = "geometry_msgs/msg/PoseWithCovarianceStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
_STORE1, _STORE2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
_UNKNOWN, _NOTHING = np.zeros(9), np.zeros(0)


def stamp(t: float) -> int:
    """Of a time [s] since the recording began [ns]."""
    return EPOCH + round(t * 1e9)


def _is_first(path: Path) -> bool:
    return path.suffix == ".bag"


def _store(path: Path) -> Any:
    return _STORE1 if _is_first(path) else _STORE2


@dataclass(frozen=True)
class Topic:
    """Messages of `kind` with header stamps t (T,) [s], of `values` (T, m), 4 ms apart."""

    kind: str
    t: np.ndarray
    values: np.ndarray
    absent: str = ""  # what an Imu says it does not measure
    stamped: bool = True


@dataclass(frozen=True)
class States:
    """Joint states at t (T,) [s]; without tau their messages have no effort."""

    names: Sequence[str]
    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray | None = None


class _Messages:
    def __init__(self, path: Path) -> None:
        self._types, self._first = _store(path).types, _is_first(path)

    def of(self, kind: str, *fields: Any) -> Any:
        return self._types[kind](*fields)

    def header(self, stamp: int) -> Any:
        time = self.of("builtin_interfaces/msg/Time", stamp // 10**9, stamp % 10**9)
        number = (0,) if self._first else ()
        return self.of("std_msgs/msg/Header", *number, time, "")

    def xyz(self, row: np.ndarray, kind: str = "Vector3") -> Any:
        return self.of(f"geometry_msgs/msg/{kind}", *map(float, row))

    def state(self, stamp: int, names: Sequence[str], *rows: np.ndarray) -> Any:
        return self.of(STATE, self.header(stamp), list(names), *rows)

    def sensor(self, topic: Topic, stamp: int, row: np.ndarray) -> Any:
        header = self.header(stamp if topic.stamped else 0)
        if topic.kind == WRENCH:
            wrench = self.of("geometry_msgs/msg/Wrench", self.xyz(row[:3]), self.xyz(row[3:]))
            return self.of(WRENCH, header, wrench)
        if topic.kind == IMU:
            level = self.xyz(np.array([0, 0, 0, 1]), "Quaternion")
            rates, forces = (
                np.r_[-1.0, np.zeros(8)] if name == topic.absent else _UNKNOWN
                for name in ("angular_velocity", "linear_acceleration")
            )
            return self.of(
                IMU, header, level, _UNKNOWN, self.xyz(row[:3]), rates, self.xyz(row[3:]), forces
            )
        pose = self.of(
            "geometry_msgs/msg/Pose", self.xyz(row[:3], "Point"), self.xyz(row[3:], "Quaternion")
        )
        if topic.kind == POSE:
            return self.of(POSE, header, pose)
        pose = self.of("geometry_msgs/msg/PoseWithCovariance", pose, np.zeros(36))
        if topic.kind == COVARIANT:
            return self.of(COVARIANT, header, pose)
        still = self.of("geometry_msgs/msg/Twist", *2 * (self.xyz(np.zeros(3)),))
        twist = self.of("geometry_msgs/msg/TwistWithCovariance", still, np.zeros(36))
        return self.of(ODOMETRY, header, "base", pose, twist)


def _write(
    path: Path, made: Mapping[str, tuple[str, Iterable[tuple[int, Any]]]], storage: StoragePlugin
) -> Path:
    """Kind and messages of each topic, with the time [ns] at which each was recorded."""
    first, store = _is_first(path), _store(path)
    encode: Callable[..., Any] = store.serialize_ros1 if first else store.serialize_cdr
    with Writer1(path) if first else Writer2(path, version=9, storage_plugin=storage) as writer:
        for name, (kind, series) in made.items():
            connection = writer.add_connection(name, kind, typestore=store)
            for recorded, message in series:
                writer.write(connection, recorded, encode(message, kind))
    return path


def write_standing(path: Path, states: States, topics: Mapping[str, Topic]) -> Path:
    """A rosbag2 folder, or a ROS 1 bag where `path` ends so; recorded in order, after 5 ms."""
    messages, late = _Messages(path), 5_000_000

    def of_states() -> Iterable[tuple[int, Any]]:
        for k, t in enumerate(states.t):
            tau = _NOTHING if states.tau is None else states.tau[k]
            at = stamp(t)
            yield at + late, messages.state(at, states.names, states.q[k], _NOTHING, tau)

    def of_topic(topic: Topic) -> Iterable[tuple[int, Any]]:
        for k, (t, row) in enumerate(zip(topic.t, topic.values, strict=True)):
            yield stamp(topic.t[0] + 0.004 * k) + late, messages.sensor(topic, stamp(t), row)

    made = {"/joint_states": (STATE, of_states())}
    made |= {name: (topic.kind, of_topic(topic)) for name, topic in topics.items()}
    return _write(path, made, StoragePlugin.SQLITE3)


def write_bag(
    path: Path,
    run: Run,
    storage: StoragePlugin = StoragePlugin.SQLITE3,
    topics: Sequence[str] = ("/joint_states",),
    names: Sequence[Sequence[str]] = (JOINTS,),
    fields: Sequence[str] = ("position", "velocity", "effort"),
    stamped: bool = True,
) -> Path:
    """Joint states alone; lists of `names` alternate from message to message."""
    messages = _Messages(path)
    parts = {"position": run.q, "velocity": run.dq, "effort": run.tau}

    def series() -> Iterable[tuple[int, Any]]:
        for k, t in enumerate(run.t):
            listed, at = names[k % len(names)], stamp(t)
            order = [JOINTS.index(name) if name in JOINTS else 0 for name in listed]
            rows = [x[k, order] if f in fields else _NOTHING for f, x in parts.items()]
            yield at + 777, messages.state(at if stamped else 0, listed, *rows)

    return _write(path, {topic: (STATE, series()) for topic in topics}, storage)
