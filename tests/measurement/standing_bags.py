"""Bags of a robot that stands: joint states, and topics of its sensors with stamps of their own."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

EPOCH = 1_700_000_000_000_000_000  # ns
WRENCH = "geometry_msgs/msg/WrenchStamped"
IMU = "sensor_msgs/msg/Imu"
POSE = "geometry_msgs/msg/PoseStamped"
COVARIANT = "geometry_msgs/msg/PoseWithCovarianceStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
_STORE1, _STORE2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
_UNKNOWN = np.zeros(9)


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
    def __init__(self, store: Any, first: bool) -> None:
        self._types, self._first = store.types, first

    def of(self, kind: str, *fields: Any) -> Any:
        return self._types[kind](*fields)

    def header(self, stamp: int) -> Any:
        time = self.of("builtin_interfaces/msg/Time", stamp // 10**9, stamp % 10**9)
        number = (0,) if self._first else ()
        return self.of("std_msgs/msg/Header", *number, time, "")

    def xyz(self, row: np.ndarray, kind: str = "Vector3") -> Any:
        return self.of(f"geometry_msgs/msg/{kind}", *map(float, row))

    def state(self, stamp: int, names: Sequence[str], *rows: np.ndarray) -> Any:
        return self.of("sensor_msgs/msg/JointState", self.header(stamp), list(names), *rows)

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


def write_standing(path: Path, states: States, topics: Mapping[str, Topic]) -> Path:
    """A rosbag2 folder, or a ROS 1 bag where `path` ends so; recorded in order, after 5 ms."""
    first = path.suffix == ".bag"
    store = _STORE1 if first else _STORE2
    messages = _Messages(store, first)
    nothing = np.zeros(0)

    def of_states() -> Iterable[tuple[float, Any]]:
        for k, t in enumerate(states.t):
            stamp = EPOCH + round(t * 1e9)
            tau = nothing if states.tau is None else states.tau[k]
            yield t, messages.state(stamp, states.names, states.q[k], nothing, tau)

    def of_topic(topic: Topic) -> Iterable[tuple[float, Any]]:
        for k, (t, row) in enumerate(zip(topic.t, topic.values, strict=True)):
            yield topic.t[0] + 0.004 * k, messages.sensor(topic, EPOCH + round(t * 1e9), row)

    made = {"/joint_states": ("sensor_msgs/msg/JointState", of_states())}
    made |= {name: (topic.kind, of_topic(topic)) for name, topic in topics.items()}
    encode: Callable[..., Any] = store.serialize_ros1 if first else store.serialize_cdr
    with Writer1(path) if first else Writer2(path, version=9) as writer:
        for name, (kind, series) in made.items():
            connection = writer.add_connection(name, kind, typestore=store)
            for t, message in series:
                recorded = EPOCH + round((t + 0.005) * 1e9)
                writer.write(connection, recorded, encode(message, kind))
    return path
