"""Sensors of a base in bags: onto the stamps of joint states, or one sentence why not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from tests.measurement.bags import (
    COVARIANT,
    IMU,
    ODOMETRY,
    POSE,
    WRENCH,
    States,
    Topic,
    write_standing,
)
from tests.measurement.recordings import JOINTS, motion, only

SECONDS = 1.5
T = np.arange(int(SECONDS * 100)) / 100.0
STATES = States(JOINTS, T, motion(T)[0])
# Faster than the joint states and between their stamps, from before them until after.
OWN = np.arange(-0.0113, SECONDS + 0.02, 0.004)


def signals(t: np.ndarray, width: int = 6) -> np.ndarray:
    """Smooth values (T, width); linear between samples 4 ms apart they are good to 6e-5."""
    rate = np.linspace(1.0, 3.0, width)
    return 3.0 * np.sin(np.outer(t, rate)) + np.arange(width)


def turning(t: np.ndarray) -> np.ndarray:
    """Poses (T, 7) that turn by a whole turn, so that quaternions come back with another sign."""
    half = np.pi * t / SECONDS
    axis = np.array([0.0, 0.6, 0.8])
    return np.column_stack([signals(t, 3), np.outer(np.sin(half), axis), np.cos(half)])


FOOT = Topic(WRENCH, OWN, signals(OWN))


Read = Callable[..., Dataset]


@pytest.fixture
def reading(tmp_path: Path) -> Read:
    """Writes a bag of these topics beside the foot's, and reads it."""

    def write_and_read(
        *rows: str, topics: dict[str, Topic] | None = None, states: States = STATES,
        file: str = "log", **declared: Any,
    ) -> Dataset:  # fmt: skip
        path = write_standing(tmp_path / file, states, {"/foot": FOOT, **(topics or {})})
        declared.setdefault("wrench", [{"channel": "/foot"}])
        return read_dataset([path], MeasurementSpec(**declared), JOINTS, rows=rows or ("base",))

    return write_and_read


def close(found: np.ndarray, wanted: np.ndarray) -> None:
    np.testing.assert_allclose(found, wanted, rtol=0, atol=6e-5)


@pytest.mark.parametrize("file", ["log", "log.bag"])
@pytest.mark.parametrize("declared", ["/foot", "foot"])
def test_a_wrench_is_put_onto_the_joint_states(reading: Read, file: str, declared: str) -> None:
    data = reading(file=file, wrench=[{"channel": declared}])
    assert data.findings == ()
    (run,) = data.runs
    np.testing.assert_array_equal(run.q, STATES.q)
    np.testing.assert_allclose(run.t, T, rtol=0, atol=1e-9)
    close(run.extra["foot"], signals(T))
    assert not run.usable().any()  # no effort was recorded


def test_efforts_are_needed_where_joints_are_rows(reading: Read) -> None:
    with pytest.raises(FileError, match="carry no effort; needed: position and effort"):
        reading("base", "joints")
    states = replace(STATES, tau=signals(T, 3))
    (run,) = reading("base", "joints", states=states, file="b").runs
    np.testing.assert_array_equal(run.tau, signals(T, 3))
    (run,) = reading("joints", states=states, file="c").runs  # it does not stand
    assert "foot" not in run.extra


def test_one_topic_or_two_are_gyroscope_and_accelerometer(reading: Read) -> None:
    unit = {"/imu/data": Topic(IMU, OWN, signals(OWN) + 1.0)}
    names = {"gyroscope": "/imu/data", "accelerometer": "/imu/data"}
    (run,) = reading(topics=unit, base={"imu": names}).runs
    close(run.extra["imu_data"], signals(T) + 1.0)
    two = {
        "/gyro": Topic(IMU, OWN, signals(OWN), absent="linear_acceleration"),
        "/acc": Topic(IMU, OWN, signals(OWN) + 1.0, absent="angular_velocity"),
    }
    names = {"gyroscope": "/gyro", "accelerometer": "/acc"}
    (run,) = reading(topics=two, file="two", base={"imu": names}).runs
    close(run.extra["gyro"], signals(T)[:, :3])
    close(run.extra["acc"], signals(T)[:, 3:] + 1.0)
    names = {"gyroscope": "/acc", "accelerometer": "/gyro"}
    with pytest.raises(FileError, match=r"/acc .*gyroscope\) holds no angular_velocity: its cov"):
        reading(topics=two, file="turned", base={"imu": names})


@pytest.mark.parametrize("kind", [POSE, ODOMETRY, COVARIANT])
def test_poses_keep_unit_quaternions_through_changes_of_sign(reading: Read, kind: str) -> None:
    poses = turning(OWN)
    poses[len(OWN) // 3 :: 2, 3:] *= -1.0  # the same orientations
    (run,) = reading(topics={"/odom": Topic(kind, OWN, poses)}, base={"pose": "/odom"}).runs
    close(run.extra["odom"], turning(T))
    sizes = np.linalg.norm(run.extra["odom"][:, 3:], axis=1)  # a chord is shorter by 9e-6
    np.testing.assert_allclose(sizes, 1.0, rtol=0, atol=1e-12)
    poses[7, 3:] = 0.0
    none = {"/pose": Topic(kind, OWN, poses)}
    with pytest.raises(FileError, match=r"/pose \(measurement.base.pose\): 1 of .* 0, 0, 0, 0"):
        reading(topics=none, file="none", base={"pose": "/pose"})


@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ("/fot", "{} has no topic '/fot', which measurement.wrench names. Did you mean '/foot'? "
                 "It has: /foot (geometry_msgs/msg/WrenchStamped), /imu (sensor_msgs/msg/Imu), "
                 "/joint_states (sensor_msgs/msg/JointState)."),
        ("imu", "{}: topic 'imu' (measurement.wrench) is of type sensor_msgs/msg/Imu; read are "
                "geometry_msgs/msg/WrenchStamped. Of these types it has: /foot."),
    ],
)  # fmt: skip
def test_a_topic_that_is_not_there_or_of_another_type(
    reading: Read, tmp_path: Path, declared: str, words: str
) -> None:
    with pytest.raises(FileError) as caught:
        reading(topics={"/imu": Topic(IMU, OWN, signals(OWN))}, wrench=[{"channel": declared}])
    assert str(caught.value) == words.format(tmp_path / "log")


def test_ragged_ends_are_cut_and_told(reading: Read) -> None:
    some = (OWN > 0.2) & (OWN < 1.3)
    foot = Topic(WRENCH, OWN[some], FOOT.values[some])
    data = reading(topics={"/foot": foot})
    inside = (foot.t[0] <= T) & (foot.t[-1] >= T)
    assert f"/foot has messages from {foot.t[0]:.3f}" in only(data.findings, "ragged").text
    assert f"{np.sum(~inside)} joint states outside are left out" in data.findings[0].text
    (run,) = data.runs
    np.testing.assert_array_equal(run.q, STATES.q[inside])
    close(run.extra["foot"], signals(T[inside]))


def test_late_messages_are_put_in_order(reading: Read) -> None:
    order = np.arange(len(OWN))
    order[40:43] = [42, 40, 41]
    (run,) = reading(topics={"/foot": Topic(WRENCH, OWN[order], FOOT.values[order])}).runs
    close(run.extra["foot"], signals(T))


def test_empty_headers_fall_back_to_the_time_of_recording(reading: Read) -> None:
    foot = Topic(WRENCH, OWN - 0.005, FOOT.values, stamped=False)  # recorded 5 ms later
    data = reading(topics={"/foot": foot})
    assert "header stamps of /foot are empty" in only(data.findings, "stamps").text
    close(data.runs[0].extra["foot"], signals(T))


def test_a_single_stamp_far_off_costs_no_more_than_itself(reading: Read) -> None:
    t = T.copy()
    t[70] += 1000.0
    data = reading(states=replace(STATES, t=t))
    assert "1 joint states outside are left out" in only(data.findings[:1], "ragged").text
    assert len(data.runs) == 1
    close(data.runs[0].extra["foot"][:70], signals(T[:70]))


def test_topics_that_never_meet(reading: Read) -> None:
    early, late = OWN[OWN < 0.7], OWN[OWN > 0.8]
    topics = {
        "/foot": Topic(WRENCH, early, signals(early)),
        "/imu": Topic(IMU, late, signals(late)),
    }
    with pytest.raises(FileError, match="at no instant all topics that `measurement` names are"):
        reading(topics=topics, base={"imu": {"gyroscope": "/imu", "accelerometer": "/imu"}})


def _paused(t: np.ndarray) -> np.ndarray:
    return t[(t < 0.6) | (t > 0.7)]


def test_what_is_recorded_again_after_a_pause_of_all_is_no_gap(reading: Read) -> None:
    t, own = _paused(T), _paused(OWN)
    states = States(JOINTS, t, motion(t)[0])
    data = reading(topics={"/foot": Topic(WRENCH, own, signals(own))}, states=states)
    only(data.findings, "gap")
    close(np.concatenate([run.extra["foot"] for run in data.runs]), signals(t))


@pytest.mark.parametrize(
    ("own", "words"),
    [
        (_paused, r"/foot \(measurement.wrench\) has no message for 0\.104 s at 0\.597 s, while "
                  r"joint states go on \(usually every 0\.004 s; such gaps: 1\)"),
        (lambda t: t[t < 0.4], r"messages from -0\.011 to 0\.397 s, joint states are there from "
                               r"0\.000 to 1\.490 s.*by one clock"),
        (lambda t: t + 3600.0, r"messages from 3599\.989 to"),
        (lambda t: t[:1], "has 1 messages with 1 different stamps; at least 2 are needed"),
        (lambda t: t[:9] * 0.0, "has 9 messages with 1 different stamps"),
        (lambda t: t[:0], "has 0 messages"),
        (lambda t: np.concatenate([t, t]), r"go back by 1\.53 s at message 384: the clock start"),
    ],
)  # fmt: skip
def test_what_does_not_cover_the_joint_states(
    reading: Read, tmp_path: Path, own: Callable[[np.ndarray], np.ndarray], words: str
) -> None:
    t = own(OWN)
    with pytest.raises(FileError, match=words) as caught:
        reading(topics={"/foot": Topic(WRENCH, t, signals(t))})
    assert str(tmp_path / "log") in str(caught.value)
