"""Regions of joint space: inside or out, gradients, and motions that go around them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.constraints.keep_out import KeepOut, build_keep_out
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.admissible import fine_times
from excite_cli.excitation.gradient_check import central_differences
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.start import clear_posture
from excite_cli.excitation.task import MotionTask
from excite_cli.robot.model import Robot, build_robot
from tests.excitation.smoke import CONFIG, one_motion, smoke
from tests.robot.coupled_robots import HAND, coupled_robot

ARM = RobotSpec(urdf=str(CONFIG.parents[1] / "data" / "smoke_arm.urdf"))
Regions = dict[str, dict[str, tuple[float, float]]]
REGIONS: Regions = {
    "cable": {"shoulder_yaw": (0.5, 1.5), "wrist_roll": (1.0, 3.0)},
    "shelf": {"elbow": (1.0, 1.4), "slide": (0.05, 0.1), "shoulder_pitch": (-1.0, 0.5)},
}


def _keep_out(regions: Regions = REGIONS) -> tuple[Robot, KeepOut]:
    robot = build_robot(ARM)
    constraint = build_keep_out(regions, robot)
    assert constraint is not None
    return robot, constraint


def _states(robot: Robot, q: np.ndarray) -> States:
    return States(BatchKinematics(robot), q, np.zeros_like(q), np.zeros_like(q))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_negative_inside_and_never_more_than_the_way_there(seed: int) -> None:
    robot, constraint = _keep_out()
    rng = np.random.default_rng(seed)
    q = rng.uniform(-3, 3, (40, robot.n))
    for region in constraint.regions:  # random positions hardly meet a region
        some = rng.choice(20, 8, replace=False)
        q[some[:, None], region.joints] = rng.uniform(region.low, region.high, (8, len(region.low)))
    margins = constraint.margins(_states(robot, q))
    for column, region in enumerate(constraint.regions):
        at = q[:, region.joints]
        inside = np.all((at > region.low) & (at < region.high), axis=1)
        assert np.array_equal(margins[:, column] < 0, inside)
        way = np.abs(at - np.clip(at, region.low, region.high)).max(axis=1)
        np.testing.assert_allclose(np.maximum(margins[:, column], 0.0), way, atol=1e-15)


def test_gradients_equal_differences() -> None:
    robot, constraint = _keep_out()
    q = np.random.default_rng(1).uniform(-1.5, 1.5, (25, robot.n))
    q[:8, [0, 3]] = np.random.default_rng(2).uniform([0.5, 1.0], [1.5, 3.0], (8, 2))
    times, columns = np.repeat(np.arange(25), 2), np.tile([0, 1], 25)
    by_q, by_v, by_a = constraint.gradients(_states(robot, q), times, columns)
    assert by_q is not None
    assert by_v is None
    assert by_a is None
    for row, (t, column) in enumerate(zip(times, columns, strict=True)):
        expected = central_differences(
            lambda x, c=column: float(constraint.margins(_states(robot, x[None]))[0, c]),
            q[t],
            1e-7,
        )
        np.testing.assert_allclose(by_q[row], expected, atol=1e-6)


def test_names_units_and_reason() -> None:
    regions = {**REGIONS, "slider": {"slide": (0.1, 0.2)}}
    robot, constraint = _keep_out(regions)
    assert constraint.labels == ("cable", "shelf", "slider")
    assert [constraint.unit_of(k) for k in range(3)] == ["rad", "rad or m", "m"]
    q = np.array([[1.0, 0.0, 0.0, 2.0, 0.0]])
    reason = constraint.why_not(_states(robot, q))
    assert "region 'cable' (shoulder_yaw 1.000 in [0.5, 1.5], wrist_roll 2.000 in [1, 3])" in reason
    assert constraint.why_not(_states(robot, np.zeros((1, 5)))) == ""


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ({"elbw": (0.0, 1.0)}, "keep_out.a: the robot has no joint 'elbw'. Did you mean 'elbow'"),
        ({"elbow": (-3.0, 3.0)}, "covers all positions of elbow"),
        ({"elbow": (-2.6, 2.6), "slide": (-1.0, 1.0)}, "covers all positions of elbow, slide"),
        ({"finger_2": (0.0, 0.01)}, "keep_out.a: joint 'finger_2' follows another one"),
    ],
)
def test_what_cannot_be_asked_is_refused(
    region: dict[str, tuple[float, float]], message: str
) -> None:
    robot = coupled_robot(HAND) if "finger_2" in region else build_robot(ARM)
    with pytest.raises(ConfigError, match=message):
        build_keep_out({"a": region}, robot)


def test_joints_that_do_not_move_count_where_they_are_locked() -> None:
    spec = ARM.model_copy(update={"joints": ("shoulder_yaw", "elbow"), "posture": {"slide": 0.1}})
    robot = build_robot(spec)
    region = {"elbow": (0.0, 1.0), "slide": (0.05, 0.15)}
    inside = build_keep_out({"a": region}, robot)
    assert inside is not None
    assert inside.regions[0].joints.tolist() == [1]
    assert build_keep_out({"a": {**region, "slide": (0.0, 0.05)}}, robot) is None
    with pytest.raises(ConfigError, match="covers all positions of slide"):
        build_keep_out({"a": {"slide": (0.0, 0.15)}}, robot)


def _problem(*settings: str) -> Problem:
    return smoke("optimizer.max_iterations=40", "sequence.motions=1", *settings)


def _entered(problem: Problem) -> bool:
    """Whether the motion is ever, at 1 kHz, in the region of the test below."""
    basis = problem.trajectory.basis(fine_times(problem))
    q = problem.states(one_motion(problem).coefficients, basis).q
    return bool(np.any((q[:, 1] > 0.7) & (q[:, 2] < 0.7)))


@pytest.mark.long
def test_with_it_the_region_is_not_entered_and_without_it_it_is() -> None:
    region = "constraints.keep_out={front: {shoulder_pitch: [0.7, 3], elbow: [-3, 0.7]}}"
    assert not _entered(_problem(region))
    assert _entered(_problem())


def test_a_posture_inside_is_refused_and_one_beside_is_not() -> None:
    inside = _problem("constraints.keep_out={front: {shoulder_pitch: [0.5, 3], elbow: [0.7, 3]}}")
    with pytest.raises(NoAdmissibleMotionError, match=r"at robot.posture, .* region 'front'"):
        clear_posture(MotionTask(inside), 1)
    beside = _problem("constraints.keep_out={front: {shoulder_pitch: [0.5, 3], elbow: [0.8, 3]}}")
    assert not clear_posture(MotionTask(beside), 1).as_configured
