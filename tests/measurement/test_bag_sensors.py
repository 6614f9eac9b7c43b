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
from tests.measurement.recordings import JOINTS, motion, only
from tests.measurement.standing_bags import (
    COVARIANT,
    IMU,
    ODOMETRY,
    POSE,
    WRENCH,
    States,
    Topic,
    write_standing,
)

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


def read(path: Path, *rows: str, **declared: Any) -> Dataset:
    declared.setdefault("wrench", [{"channel": "/foot"}])
    return read_dataset([path], MeasurementSpec(**declared), JOINTS, rows=rows or ("base",))


def close(found: np.ndarray, wanted: np.ndarray) -> None:
    np.testing.assert_allclose(found, wanted, rtol=0, atol=6e-5)


@pytest.mark.parametrize("file", ["log", "log.bag"])
@pytest.mark.parametrize("declared", ["/foot", "foot"])
def test_a_wrench_is_put_onto_the_joint_states(tmp_path: Path, file: str, declared: str) -> None:
    data = read(write_standing(tmp_path / file, STATES, {"/foot": FOOT}),
                wrench=[{"channel": declared}])  # fmt: skip
    assert data.findings == ()
    (run,) = data.runs
    np.testing.assert_array_equal(run.q, STATES.q)
    np.testing.assert_allclose(run.t, T, rtol=0, atol=1e-9)
    close(run.extra["foot"], signals(T))
    assert not run.usable().any()  # no effort was recorded


def test_efforts_are_needed_where_joints_are_rows(tmp_path: Path) -> None:
    path = write_standing(tmp_path / "a", STATES, {"/foot": FOOT})
    with pytest.raises(FileError, match="carry no effort; needed: position and effort"):
        read(path, "base", "joints")
    states = replace(STATES, tau=signals(T, 3))
    (run,) = read(write_standing(tmp_path / "b", states, {"/foot": FOOT}), "base", "joints").runs
    np.testing.assert_array_equal(run.tau, signals(T, 3))


def test_a_robot_that_does_not_stand_needs_none_of_it(tmp_path: Path) -> None:
    states = replace(STATES, tau=signals(T, 3))
    (run,) = read(write_standing(tmp_path / "log", states, {}), "joints").runs
    assert "foot" not in run.extra


def test_one_topic_is_gyroscope_and_accelerometer(tmp_path: Path) -> None:
    unit = Topic(IMU, OWN, signals(OWN) + 1.0)
    path = write_standing(tmp_path / "log", STATES, {"/foot": FOOT, "/imu/data": unit})
    names = {"gyroscope": "/imu/data", "accelerometer": "/imu/data"}
    (run,) = read(path, base={"imu": names}).runs
    close(run.extra["imu_data"], signals(T) + 1.0)


def test_two_topics_are_gyroscope_and_accelerometer(tmp_path: Path) -> None:
    topics = {
        "/foot": FOOT,
        "/gyro": Topic(IMU, OWN, signals(OWN), absent="linear_acceleration"),
        "/acc": Topic(IMU, OWN, signals(OWN) + 1.0, absent="angular_velocity"),
    }
    path = write_standing(tmp_path / "log", STATES, topics)
    (run,) = read(path, base={"imu": {"gyroscope": "/gyro", "accelerometer": "/acc"}}).runs
    close(run.extra["gyro"], signals(T)[:, :3])
    close(run.extra["acc"], signals(T)[:, 3:] + 1.0)
    with pytest.raises(FileError, match=r"/acc .*gyroscope\) holds no angular_velocity: its cov"):
        read(path, base={"imu": {"gyroscope": "/acc", "accelerometer": "/gyro"}})


@pytest.mark.parametrize("kind", [POSE, ODOMETRY, COVARIANT])
def test_poses_keep_unit_quaternions_through_changes_of_sign(tmp_path: Path, kind: str) -> None:
    poses = turning(OWN)
    poses[len(OWN) // 3 :: 2, 3:] *= -1.0  # the same orientations
    path = write_standing(
        tmp_path / "log", STATES, {"/foot": FOOT, "/odom": Topic(kind, OWN, poses)}
    )
    (run,) = read(path, base={"pose": "/odom"}).runs
    close(run.extra["odom"], turning(T))
    sizes = np.linalg.norm(run.extra["odom"][:, 3:], axis=1)  # a chord is shorter by 9e-6
    np.testing.assert_allclose(sizes, 1.0, rtol=0, atol=1e-12)


def test_an_orientation_that_is_none(tmp_path: Path) -> None:
    poses = turning(OWN)
    poses[7, 3:] = 0.0
    path = write_standing(
        tmp_path / "log", STATES, {"/foot": FOOT, "/pose": Topic(POSE, OWN, poses)}
    )
    with pytest.raises(FileError, match=r"/pose \(measurement.base.pose\): 1 of .* 0, 0, 0, 0"):
        read(path, base={"pose": "/pose"})


def test_a_topic_that_is_not_there(tmp_path: Path) -> None:
    path = write_standing(tmp_path / "log", STATES, {"/left_foot": FOOT})
    with pytest.raises(FileError) as caught:
        read(path, wrench=[{"channel": "/left_fot"}])
    assert str(caught.value) == (
        f"{path} has no topic '/left_fot', which measurement.wrench names. Did you mean "
        "'/left_foot'? It has: /joint_states (sensor_msgs/msg/JointState), /left_foot "
        "(geometry_msgs/msg/WrenchStamped)."
    )


def test_a_topic_of_another_type(tmp_path: Path) -> None:
    unit = Topic(IMU, OWN, signals(OWN))
    path = write_standing(tmp_path / "log", STATES, {"/foot": FOOT, "/imu": unit})
    with pytest.raises(FileError) as caught:
        read(path, wrench=[{"channel": "imu"}])
    assert str(caught.value) == (
        f"{path}: topic 'imu' (measurement.wrench) is of type sensor_msgs/msg/Imu; read are "
        "geometry_msgs/msg/WrenchStamped. Of these types it has: /foot."
    )


def test_ragged_ends_are_cut_and_told(tmp_path: Path) -> None:
    some = (OWN > 0.2) & (OWN < 1.3)
    foot = Topic(WRENCH, OWN[some], FOOT.values[some])
    data = read(write_standing(tmp_path / "log", STATES, {"/foot": foot}))
    inside = (foot.t[0] <= T) & (foot.t[-1] >= T)
    assert f"/foot has messages from {foot.t[0]:.3f}" in only(data.findings, "ragged").text
    assert f"{np.sum(~inside)} joint states outside are left out" in data.findings[0].text
    (run,) = data.runs
    np.testing.assert_array_equal(run.q, STATES.q[inside])
    close(run.extra["foot"], signals(T[inside]))


def test_late_messages_are_put_in_order(tmp_path: Path) -> None:
    order = np.arange(len(OWN))
    order[40:43] = [42, 40, 41]
    foot = Topic(WRENCH, OWN[order], FOOT.values[order])
    (run,) = read(write_standing(tmp_path / "log", STATES, {"/foot": foot})).runs
    close(run.extra["foot"], signals(T))


def test_empty_headers_fall_back_to_the_time_of_recording(tmp_path: Path) -> None:
    foot = Topic(WRENCH, OWN - 0.005, FOOT.values, stamped=False)  # recorded 5 ms later
    data = read(write_standing(tmp_path / "log", STATES, {"/foot": foot}))
    assert "header stamps of /foot are empty" in only(data.findings, "stamps").text
    close(data.runs[0].extra["foot"], signals(T))


def test_a_single_stamp_far_off_costs_no_more_than_itself(tmp_path: Path) -> None:
    t = T.copy()
    t[70] += 1000.0
    states = States(JOINTS, t, STATES.q)
    data = read(write_standing(tmp_path / "log", states, {"/foot": FOOT}))
    assert "1 joint states outside are left out" in only(data.findings[:1], "ragged").text
    assert len(data.runs) == 1
    close(data.runs[0].extra["foot"][:70], signals(T[:70]))


def test_topics_that_never_meet(tmp_path: Path) -> None:
    early, late = OWN[OWN < 0.7], OWN[OWN > 0.8]
    topics = {
        "/foot": Topic(WRENCH, early, signals(early)),
        "/imu": Topic(IMU, late, signals(late)),
    }
    path = write_standing(tmp_path / "log", STATES, topics)
    with pytest.raises(FileError, match="at no instant all topics that `measurement` names are"):
        read(path, base={"imu": {"gyroscope": "/imu", "accelerometer": "/imu"}})


def _paused(t: np.ndarray) -> np.ndarray:
    return t[(t < 0.6) | (t > 0.7)]


def test_what_is_recorded_again_after_a_pause_of_all_is_no_gap(tmp_path: Path) -> None:
    t, own = _paused(T), _paused(OWN)
    states = States(JOINTS, t, motion(t)[0])
    path = write_standing(tmp_path / "log", states, {"/foot": Topic(WRENCH, own, signals(own))})
    data = read(path)
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
    tmp_path: Path, own: Callable[[np.ndarray], np.ndarray], words: str
) -> None:
    t = own(OWN)
    path = write_standing(tmp_path / "log", STATES, {"/foot": Topic(WRENCH, t, signals(t))})
    with pytest.raises(FileError, match=words) as caught:
        read(path)
    assert str(path) in str(caught.value)
