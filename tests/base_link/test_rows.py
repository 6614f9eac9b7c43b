"""[0; τ] + Σ Jᵀ f = Y φ, against MuJoCo's inverse dynamics of a free tree."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.base_link.rows import with_base
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.base_joints import BASE_JOINTS
from excite_cli.robot.model import Robot
from tests.base_link.stander import FEET, Array, Swayed, stander, swayed

ON_FEET = [{"channel": foot, "link": foot} for foot in FEET]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return stander(tmp_path_factory.mktemp("urdf"))


@pytest.fixture(scope="module")
def log() -> Swayed:
    return swayed(samples=60)


def converted(robot: Robot, run: Run, torques: bool = True, **given: object) -> Run:
    spec = MeasurementSpec.model_validate({"base": {"pose": "pose"}, "wrench": ON_FEET, **given})
    data = Dataset(robot.joint_names[6:], (run,))
    found, _ = with_base(robot, data, spec, torques)
    assert found.joint_names == robot.joint_names
    assert found.joint_names[:6] == BASE_JOINTS
    return found.runs[0]


def load(robot: Robot, log: Swayed) -> Array:
    return RigidBody(robot, standard_parameters(robot), log.q, log.v, log.a).load


def test_base_and_joints_are_those_of_mujoco(robot: Robot, log: Swayed) -> None:
    run = converted(robot, log.run)
    assert run.q == pytest.approx(log.q, abs=1e-12)
    scale = np.abs(run.tau).max(axis=0)
    assert np.abs(run.tau - load(robot, log)).max() / scale.max() < 1e-6
    assert (np.abs(run.tau - load(robot, log)).max(axis=0) < 1e-5 * scale + 1e-5).all()
    assert run.base_rows == 6
    assert run.usable().all()


def test_a_force_plate_is_what_both_feet_are(robot: Robot, log: Swayed) -> None:
    """The same wrench about a point of the floor, in axes of the world."""
    run, point = log.run, np.array([0.3, -0.2, -0.95])
    spec = MeasurementSpec.model_validate({"base": {"pose": "pose"}, "wrench": ON_FEET})
    both, _ = with_base(robot, Dataset(robot.joint_names[6:], (run,)), spec, True)
    wanted = both.runs[0].tau
    pose = run.extra["pose"]
    plate = np.empty((len(run.t), 6))
    for k in range(len(run.t)):  # the wrench at the root's origin, in the world, then at the point
        force = wanted[k, :3]
        moment = np.linalg.solve(_axes(log.q[k, 3:6]).T, wanted[k, 3:6])
        plate[k] = [*force, *(moment + np.cross(pose[k, :3] - point, force))]
    run = replace(run, extra={"pose": pose, "plate": -plate})
    sensor = {"channel": "plate", "frame": "world", "position": list(point), "acts_on": "sensor"}
    assert converted(robot, run, wrench=[sensor]).tau == pytest.approx(wanted, abs=1e-9)


def _axes(angles: Array) -> Array:
    """Columns: axes of yaw, pitch and roll in the world."""
    yaw, pitch, _ = angles
    about_y = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    about_x = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)])
    return np.column_stack([[0.0, 0.0, 1.0], about_y, about_x])


def test_without_torques_only_the_base_counts(robot: Robot, log: Swayed) -> None:
    run = converted(robot, log.run, torques=False)
    assert run.usable()[:, :6].all()
    assert not run.usable()[:, 6:].any()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"wrench": [{"channel": "left_sol"}]},
         r"run 'sway' has no channel 'left_sol' \(nor left_sol_fx … left_sol_mz\), which "
         r"measurement.wrench names. Did you mean 'left_sole'\?"),
        ({"wrench": [{"channel": "gyroscope"}]}, r"'gyroscope' .* has the shape \(60, 3\); "
         r"expected is \(60, 6\): fx, fy, fz, mx, my, mz"),
        ({"base": {"pose": "gyroscope"}}, r"expected is \(60, 7\): x, y, z, qx, qy, qz, qw"),
    ],
)  # fmt: skip
def test_what_the_log_lacks_is_told(robot: Robot, log: Swayed, given: dict, words: str) -> None:
    with pytest.raises(FileError, match=words):
        converted(robot, log.run, **given)


def test_columns_of_their_own_are_a_channel(robot: Robot, log: Swayed) -> None:
    extra = dict(log.run.extra)
    wrench = extra.pop("left_sole")
    names = ("fx", "fy", "fz", "mx", "my", "mz")
    extra |= {f"left_sole_{part}": wrench[:, k] for k, part in enumerate(names)}
    apart = converted(robot, replace(log.run, extra=extra)).tau
    assert np.array_equal(apart, converted(robot, log.run).tau)


def test_a_gap_in_a_wrench_is_told(robot: Robot, log: Swayed) -> None:
    extra = {name: values.copy() for name, values in log.run.extra.items()}
    extra["right_sole"][3:5, 2] = np.nan
    words = r"channel 'right_sole' .* is not a number in 2 of 60 samples"
    with pytest.raises(FileError, match=words):
        converted(robot, replace(log.run, extra=extra))


def test_an_unknown_link_is_told(robot: Robot, log: Swayed) -> None:
    with pytest.raises(ConfigError, match=r"measurement.wrench.link: the robot has no link 'sole'"):
        converted(robot, log.run, wrench=[{"channel": "left_sole", "link": "sole"}])
