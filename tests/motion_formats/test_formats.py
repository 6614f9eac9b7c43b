"""Exported motions: the same numbers when read again, valid messages, consistent derivatives."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.errors import ConfigError, FileError, MissingExtraError
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.start import random_start
from excite_cli.export.timed import instants, repeated, timed_motion
from excite_cli.measurement.text_table import read_table
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.catalogue import MOTION_FORMATS, read_motion
from excite_cli.motion_formats.joint_trajectory import joint_trajectory
from excite_cli.motion_formats.rosbag2 import MESSAGE, message_of
from excite_cli.motion_formats.timed_motion import TimedMotion
from excite_cli.simulation.mujoco_model import build_plant
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fade import Chain, Segment
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.sampled import through_samples
from tests.excitation.smoke import task_of

# Names that a careless writer of YAML, CSV or JSON trips over.
JOINTS = ("shoulder_pan", "q_odd name: [1]", "on", "ünder/ns, 7", "01")


def chain() -> Chain:
    """One period of a Fourier series whose duration is no whole number of steps."""
    alpha = np.random.default_rng(8).normal(size=(9, len(JOINTS)))
    alpha[:, 2] *= 1e-7  # numbers that are written with an exponent
    return Chain((Segment("motion_1", FourierTrajectory(4, 0.77), alpha),))


FORMATS = [found() for found in MOTION_FORMATS.members.values()]


def _written(exporter: MotionFormat, folder: Path, rate: float = 100.0) -> tuple[Path, Any]:
    timed = timed_motion("motion_1", JOINTS, chain(), rate, False, exporter.whole_nanoseconds)
    path = folder / f"out{exporter.suffix}"
    exporter.write(path, timed)
    return path, timed


@pytest.mark.parametrize("exporter", FORMATS, ids=MOTION_FORMATS.members)
def test_the_same_motion_is_read_again(exporter: MotionFormat, tmp_path: Path) -> None:
    """Its numbers, and what is between the samples."""
    path, timed = _written(exporter, tmp_path, rate=250.0)
    found, note = read_motion(path, JOINTS)
    assert note == ""
    assert found.joint_names == JOINTS
    for name in ("t", "q", "v", "a"):
        assert np.array_equal(getattr(found, name), getattr(timed, name)), name
    assert [item.name for item in tmp_path.iterdir()] == [path.name]
    found, _ = read_motion(path, JOINTS[::-1])
    family, alpha = through_samples(found.t, found.q, found.v, found.a)
    times = np.linspace(0.0, timed.t[-1], 3001)
    for one, other in zip(family.states(times, alpha), chain().states(times), strict=True):
        assert np.abs(one[:, ::-1] - other).max() < 1e-7


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_speeds_and_accelerations_are_the_derivatives(rate: float, tmp_path: Path) -> None:
    path, _ = _written(MOTION_FORMATS.members["csv"](), tmp_path, rate)
    found, _ = read_motion(path, JOINTS)
    assert found.v is not None
    assert found.a is not None
    even = slice(0, -1)  # the last step has another length
    h = 1.0 / rate
    for values, slopes in ((found.q, found.v), (found.v, found.a)):
        x, wanted = values[even], slopes[even][1:-1]
        error = np.abs((x[2:] - x[:-2]) / (2 * h) - wanted).max()
        third = np.abs(np.diff(slopes[even], 2, axis=0)).max() / h**2
        assert error < 1.05 * third * h**2 / 6 + 1e-9
    worst = np.abs((found.q[2:-1] - found.q[:-3]) / (2 * h) - found.v[1:-2]).max()
    assert worst < 40 * h**2


@pytest.mark.parametrize(("duration", "rate"), [(6.0, 1000), (2 * np.pi / 0.77, 300), (0.9, 1.0)])
def test_instants_end_where_the_motion_ends(duration: float, rate: float) -> None:
    t = instants(duration, rate)
    assert t[0] == 0.0
    assert t[-1] == duration
    steps = np.diff(t) * rate
    assert steps[:-1] == pytest.approx(1.0)
    assert 0.5 <= steps[-1] + 1e-9 < 1.5 + 2e-9
    even = np.diff(instants(duration, rate, equidistant=True))
    assert even == pytest.approx(even[0])
    assert even.sum() == pytest.approx(duration)


def test_periods_go_on_without_a_jump_or_are_refused() -> None:
    segment = chain().segments[0]
    long = timed_motion("m", JOINTS, repeated(segment, 3, JOINTS), 200.0)
    assert long.t[-1] == pytest.approx(3 * segment.trajectory.duration)
    wanted = segment.trajectory.states(long.t, segment.coefficients)
    for one, other in zip((long.q, long.v, long.a), wanted, strict=True):
        assert one == pytest.approx(other, abs=1e-9)
    spline = BSplineTrajectory(2.0, 12)
    moved = np.random.default_rng(0).normal(size=(12, 5))
    with pytest.raises(ConfigError, match=r"m does not end as it starts \(position of"):
        repeated(Segment("m", spline, moved), 2, JOINTS)
    moved[:3], moved[-3:] = moved[0], moved[0]
    assert len(repeated(Segment("m", spline, moved), 2, JOINTS).segments) == 2
    with pytest.raises(ConfigError, match="up to 2,000,000 are written"):
        instants(3000.0, 1000.0)


def test_the_csv_is_a_table_for_the_reader_of_measured_data(tmp_path: Path) -> None:
    path, timed = _written(MOTION_FORMATS.members["csv"](), tmp_path)
    columns = read_table(path).columns
    assert list(columns)[:2] == ["t", "q_shoulder_pan"]
    assert np.array_equal(columns["ddq_on"], timed.a[:, 2])


def test_yaml_readers_take_every_number_for_a_number(tmp_path: Path) -> None:
    path, timed = _written(MOTION_FORMATS.members["ros2"](), tmp_path, rate=20.0)
    text = path.read_text(encoding="utf-8")
    assert "e-0" in text
    tree = yaml.safe_load(text)  # as `ros2 topic pub` reads its argument
    assert tree == joint_trajectory(timed)


@pytest.mark.parametrize("release", ["ROS2_HUMBLE", "LATEST"])
@pytest.mark.parametrize("source", ["ros2", "moveit"])
def test_text_forms_are_valid_messages(source: str, release: str, tmp_path: Path) -> None:
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores[release])
    path, timed = _written(MOTION_FORMATS.members[source](), tmp_path, rate=20.0)
    text = path.read_text(encoding="utf-8")
    tree = yaml.safe_load(text) if source == "ros2" else json.loads(text)
    if source == "moveit":
        assert list(tree) == ["joint_trajectory", "multi_dof_joint_trajectory"]
        assert tree["multi_dof_joint_trajectory"]["points"] == []
        tree = tree["joint_trajectory"]
    _same_fields(store, MESSAGE, tree)
    message = message_of(store, tree)
    data = store.serialize_cdr(message, MESSAGE)
    again = store.deserialize_cdr(data, MESSAGE)
    assert store.serialize_cdr(again, MESSAGE) == data
    assert again.joint_names == list(JOINTS)
    assert np.array_equal([point.positions for point in again.points], timed.q)
    stamps = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in again.points]
    assert stamps == pytest.approx(timed.t, abs=1e-9)


def _same_fields(store: Any, name: str, tree: Any) -> None:
    """Every field of the definition is there, in its order, and no other; all the way down."""
    fields = store.fielddefs[name][1]
    assert list(tree) == [field for field, _ in fields]
    for field, (kind, inner) in fields:
        value = tree[field]
        if kind.name == "NAME":
            _same_fields(store, inner, value)
        elif kind.name == "SEQUENCE" and inner[0][0].name == "NAME":
            for item in value[:3]:
                _same_fields(store, inner[0][1], item)


@pytest.mark.parametrize("name", ["rosbag2", "mcap"])
def test_bags_hold_one_message_and_are_replaced_whole(name: str, tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    path, timed = _written(MOTION_FORMATS.members[name](), tmp_path)
    MOTION_FORMATS.members[name]().write(path, timed)
    with rosbag2.Reader(path) as reader:
        (connection,) = reader.connections
        assert (connection.topic, connection.msgtype) == ("/joint_trajectory", MESSAGE)
        assert connection.msgcount == 1
    suffix = {"rosbag2": ".db3", "mcap": ".mcap"}[name]
    assert {item.suffix for item in path.iterdir()} == {".yaml", suffix}
    (single,) = path.glob(f"*{suffix}")
    assert np.array_equal(read_motion(single, JOINTS)[0].q, timed.q)
    other = tmp_path / "folder"
    other.mkdir()
    with pytest.raises(FileError, match="exists and is not a bag"):
        MOTION_FORMATS.members[name]().write(other, timed)


def test_without_rosbags_there_is_one_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[bags\]'"):
        _written(MOTION_FORMATS.members["rosbag2"](), tmp_path)
    assert list(tmp_path.iterdir()) == []


mujoco = pytest.importorskip("mujoco")
RATE = 1000.0
STIFFNESS = 150.0  # rad/s: kp = STIFFNESS² and kv = 2 STIFFNESS per unit of the joint's inertia


def _played(problem: Problem, motion: TimedMotion) -> np.ndarray:
    """RMS error (n,) of position servos with gravity compensation, their targets from the file."""
    assert motion.v is not None
    plant = build_plant(problem.robot, standard_parameters(problem.robot), 5e-4)
    model, data = plant.model, plant.new_data()
    at = plant.motor
    data.qpos[at], data.qvel[at] = motion.q[0], motion.v[0]
    mass = np.empty((model.nv, model.nv))
    errors = np.empty_like(motion.q)
    for k, (q, v) in enumerate(zip(motion.q, motion.v, strict=True)):
        mujoco.mj_forward(model, data)
        errors[k] = q - data.qpos[at]
        if k % 10 == 0:
            mujoco.mj_fullM(model, data, mass)
            inertia = np.diag(mass)[at]
        wanted = STIFFNESS**2 * errors[k] + 2 * STIFFNESS * (v - data.qvel[at])
        data.qfrc_applied[at] = data.qfrc_bias[at] + inertia * wanted
        for _ in range(2):
            mujoco.mj_step(model, data)
    return np.sqrt(np.mean(errors**2, axis=0))


def test_the_plan_is_followed(tmp_path: Path) -> None:
    """By position control in MuJoCo, of a motion as fast as the limits of the arm let it be."""
    task = task_of("constraints.self_collision=null")
    problem, joints = task.problem, task.problem.robot.joint_names
    x = random_start(task, base_motion(task, 1), (1, 1))
    planned = Chain((Segment("motion_1", problem.trajectory, task.coefficients(x)),))
    exporter = MOTION_FORMATS.members["ros2"]()
    path = tmp_path / f"m{exporter.suffix}"
    exporter.write(
        path, timed_motion("m", joints, planned, RATE, False, exporter.whole_nanoseconds)
    )
    motion, _ = read_motion(path, joints)
    assert np.ptp(motion.q, axis=0).max() > 0.5
    error = _played(problem, motion)
    assert error.max() < 1e-3, error  # 0.6 mrad when written, of a motion of 2.1 rad
    wrong = replace(motion, v=motion.v[:, [1, 0, 2, 3, 4]])
    assert _played(problem, wrong).max() > 5e-3, "speeds exchanged would be seen"
