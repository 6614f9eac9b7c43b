"""Sensors of a base in a bag: their messages, put onto the stamps of the joint states.

Every topic has stamps of its own. Between its messages all values are taken linearly; quaternions
keep their sign from message to message for that, and are normalised again. A recorder begins and
ends its topics one after the other: where one of them is not yet, or no longer there, the run is
cut. What is missing in between is refused.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.base_channel import BaseChannel, SensorKind
from excite_cli.measurement.dataset import Array, Finding, Mask
from excite_cli.measurement.joint_states import MessageStamps, Stamps, unstamped_finding
from excite_cli.measurement.reader import RawRun

_GAP, _STEPS = 0.02, 3.5  # s; times the usual step: as joint states are split at gaps
_RAGGED = 1.0  # s: topics of a recorder begin and end one after the other
_BACK = 10  # steps: messages may come late, a clock does not


@dataclass(frozen=True)
class _Reading:
    """Message types that hold a channel, and how its values are taken from them."""

    types: tuple[str, ...]
    values: Callable[[Any], tuple[float, ...]]


def _xyz(vector: Any) -> tuple[float, ...]:
    return vector.x, vector.y, vector.z


def _wrench(message: Any) -> tuple[float, ...]:
    return *_xyz(message.wrench.force), *_xyz(message.wrench.torque)


def _rates(message: Any) -> tuple[float, ...]:
    return _xyz(message.angular_velocity)


def _forces(message: Any) -> tuple[float, ...]:
    return _xyz(message.linear_acceleration)


def _unit(message: Any) -> tuple[float, ...]:
    return *_rates(message), *_forces(message)


def _pose(message: Any) -> tuple[float, ...]:
    pose = getattr(message.pose, "pose", message.pose)  # with covariance, or bare
    return *_xyz(pose.position), *_xyz(pose.orientation), pose.orientation.w


_IMU = ("sensor_msgs/msg/Imu",)
_POSES = (
    "geometry_msgs/msg/PoseStamped",
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
)
_READINGS = {
    SensorKind.WRENCH: _Reading(("geometry_msgs/msg/WrenchStamped",), _wrench),
    SensorKind.GYROSCOPE: _Reading(_IMU, _rates),
    SensorKind.ACCELEROMETER: _Reading(_IMU, _forces),
    SensorKind.IMU: _Reading(_IMU, _unit),
    SensorKind.POSE: _Reading(_POSES, _pose),
}
# A driver marks in Imu what its unit does not measure by a covariance of -1.
_ABSENT = {
    SensorKind.GYROSCOPE: ("angular_velocity",),
    SensorKind.ACCELEROMETER: ("linear_acceleration",),
    SensorKind.IMU: ("angular_velocity", "linear_acceleration"),
}


def types_of(channel: BaseChannel) -> tuple[str, ...]:
    """Message types that a channel is read from."""
    return _READINGS[channel.kind].types


class SensorMessages:
    """Messages of one topic; `add` takes them in any order, `at` gives values at other stamps."""

    def __init__(self, path: Path, topic: str, channel: BaseChannel) -> None:
        self.channel = channel
        self._topic, self._where = topic, f"{path}: topic {topic} ({channel.where})"
        self._stamps = MessageStamps()
        self._values: list[tuple[float, ...]] = []

    def add(self, recorded: int, message: Any) -> None:
        """Take a decoded message, recorded at `recorded` [ns].

        Raises
        ------
        FileError
            It says that its unit does not measure what is wanted.
        """
        for field in _ABSENT.get(self.channel.kind, ()):
            if getattr(message, f"{field}_covariance")[0] == -1.0:
                raise FileError(
                    f"{self._where} holds no {field}: its covariance is -1. Name a topic that does."
                )
        self._stamps.add(recorded, message.header.stamp)
        self._values.append(_READINGS[self.channel.kind].values(message))

    def at(self, stamps: Stamps) -> "SampledChannel":
        """Values at the stamps [ns] of joint states.

        Raises
        ------
        FileError
            They are too few, their clock starts anew, they leave a gap, or do not cover the run.
        """
        own, unstamped = self._stamps.chosen()
        if len(np.unique(own)) < 2:
            raise FileError(
                f"{self._where} has {len(own)} messages with {len(np.unique(own))} different "
                "stamps; at least 2 are needed."
            )
        t, wanted = (own - stamps[0]) * 1e-9, (stamps - stamps[0]) * 1e-9
        self._refuse_restart(t)
        t, order = np.unique(t, return_index=True)
        values = np.array(self._values, dtype=float)[order]
        of_pose = self.channel.kind is SensorKind.POSE
        if of_pose:
            values[:, 3:] = self._continuous(values[:, 3:])
        within = self._within(t, wanted)
        found = np.column_stack([np.interp(wanted, t, column) for column in values.T])
        if of_pose:
            found[:, 3:] /= np.linalg.norm(found[:, 3:], axis=1, keepdims=True)
        return SampledChannel(
            self.channel.name, found, within, self._findings(unstamped, t, within)
        )

    def _refuse_restart(self, t: Array) -> None:
        steps = np.diff(t)
        forward = steps[steps > 0.0]
        back = steps < -_BACK * (np.median(forward) if len(forward) else 0.0)
        if back.any():
            place = int(np.argmax(back))
            raise FileError(
                f"{self._where}: its stamps go back by {-steps[place]:.3g} s at message "
                f"{place + 2}: the clock started anew. Give each recording as a bag of its own."
            )

    def _continuous(self, quaternions: Array) -> Array:
        """Unit quaternions (T, 4), none of the opposite sign of that before it."""
        sizes = np.linalg.norm(quaternions, axis=1, keepdims=True)
        if (sizes < 1e-6).any():
            raise FileError(
                f"{self._where}: {np.count_nonzero(sizes < 1e-6)} of {len(sizes)} orientations are "
                "0, 0, 0, 0, which is none. Name a topic whose estimator gives the orientation."
            )
        unit = quaternions / sizes
        turned = np.sum(unit[1:] * unit[:-1], axis=1) < 0.0
        return np.asarray(unit * np.cumprod(np.where([False, *turned], -1.0, 1.0))[:, None])

    def _within(self, t: Array, wanted: Array) -> Mask:
        """Which instants lie between the first and the last message."""
        early, late = wanted < t[0], wanted > t[-1]
        # By their number: a single stamp may be far off.
        apart = float(np.median(np.abs(np.diff(wanted)))) if len(wanted) > 1 else 0.0
        if max(np.count_nonzero(early), np.count_nonzero(late)) * apart > _RAGGED:
            raise FileError(
                f"{self._where} has messages from {t[0]:.3f} to {t[-1]:.3f} s, joint states are "
                f"there from {wanted.min():.3f} to {wanted.max():.3f} s, by their header stamps. "
                "Record both throughout, by one clock."
            )
        steps = np.diff(t)
        usual = float(np.median(steps))
        before = np.searchsorted(t, wanted, side="right") - 1
        inside = (before >= 0) & (before < len(steps)) & (wanted > t[before])
        missed = inside & (steps[np.clip(before, 0, len(steps) - 1)] > max(_GAP, _STEPS * usual))
        if missed.any():
            place = before[missed][np.argmax(steps[before[missed]])]
            raise FileError(
                f"{self._where} has no message for {steps[place]:.3g} s at {t[place]:.3f} s, while "
                f"joint states go on (usually every {usual:.3g} s; such gaps: "
                f"{len(set(before[missed]))}). Cut the bag there, or record it again."
            )
        return np.asarray(~early & ~late)

    def _findings(self, unstamped: bool, t: Array, within: Mask) -> tuple[Finding, ...]:
        found = []
        if unstamped:
            found.append(unstamped_finding(self._topic))
        if not within.all():
            text = (
                f"topic {self._topic} has messages from {t[0]:.3f} to {t[-1]:.3f} s: "
                f"{np.count_nonzero(~within)} joint states outside are left out"
            )
            found.append(Finding("ragged", "note", text))
        return tuple(found)


@dataclass(frozen=True)
class SampledChannel:
    """A channel `name` at the stamps of joint states: (T, width), and where it is known (T,)."""

    name: str
    values: Array
    within: Mask
    findings: tuple[Finding, ...]


def with_sensors(path: Path, raw: RawRun, sampled: Sequence[SampledChannel]) -> RawRun:
    """The run with these channels, cut to where all of them are known.

    Raises
    ------
    FileError
        That is nowhere.
    """
    if not sampled:
        return raw
    kept = np.logical_and.reduce([each.within for each in sampled])
    if not kept.any():
        raise FileError(f"{path}: at no instant all topics that `measurement` names are there.")
    columns = {
        channel: {joint: values[kept] for joint, values in by_joint.items()}
        for channel, by_joint in raw.columns.items()
    }
    others = {each.name: each.values[kept] for each in sampled}
    findings = (*raw.findings, *(found for each in sampled for found in each.findings))
    return replace(raw, t=raw.t[kept], columns=columns, others=others, findings=findings)
