"""[0; τ] + Σ Jᵀ f = Y φ, against MuJoCo's inverse dynamics of a free tree."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.base_link.wrench_rows import with_base
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.base_joints import BASE_JOINTS
from excite_cli.robot.model import Robot
from tests.base_link.stander import FEET, Array, Swayed, swayed

ON_FEET = [{"channel": foot, "link": foot} for foot in FEET]


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


def test_base_and_joints_are_those_of_mujoco(robot: Robot, log: Swayed) -> None:
    run = converted(robot, log.run)
    assert run.q == pytest.approx(log.q, abs=1e-12)
    scale = np.abs(run.tau).max(axis=0)
    off = run.tau - RigidBody(robot, standard_parameters(robot), log.q, log.v, log.a).load
    assert np.abs(off).max() / scale.max() < 1e-6
    assert (np.abs(off).max(axis=0) < 1e-5 * scale + 1e-5).all()
    assert run.base_rows == 6
    assert run.usable().all()
    extra = dict(log.run.extra)  # columns of their own are a channel
    wrench = extra.pop("left_sole")
    names = ("fx", "fy", "fz", "mx", "my", "mz")
    extra |= {f"left_sole_{part}": wrench[:, k] for k, part in enumerate(names)}
    apart = converted(robot, replace(log.run, extra=extra), torques=False)
    assert np.array_equal(apart.tau[:, :6], run.tau[:, :6])
    assert apart.usable()[:, :6].all(), "without torques only the base counts"
    assert not apart.usable()[:, 6:].any()


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


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"wrench": [{"channel": "left_sol"}]},
         r"run 'sway' has no channel 'left_sol' \(nor left_sol_fx … left_sol_mz\), which "
         r"measurement.wrench names. Did you mean 'left_sole'\?"),
        ({"wrench": [{"channel": "gyroscope"}]}, r"'gyroscope' .* has the shape \(60, 3\); "
         r"expected is \(60, 6\): fx, fy, fz, mx, my, mz"),
        ({"base": {"pose": "gyroscope"}}, r"expected is \(60, 7\): x, y, z, qx, qy, qz, qw"),
        ({"wrench": [{"channel": "gap"}]}, r"'gap' .* is not a number in 2 of 60 samples"),
        ({"wrench": [{"channel": "left_sole", "link": "sole"}]},
         r"measurement.wrench.link: the robot has no link 'sole'"),
    ],
)  # fmt: skip
def test_what_the_log_lacks_is_told(robot: Robot, log: Swayed, given: dict, words: str) -> None:
    gap = log.run.extra["right_sole"].copy()
    gap[3:5, 2] = np.nan
    with pytest.raises((ConfigError, FileError), match=words):
        converted(robot, replace(log.run, extra={**log.run.extra, "gap": gap}), **given)
