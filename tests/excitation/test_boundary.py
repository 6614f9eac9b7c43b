"""Given postures at start and end: exact, for both families, and kept by the optimiser."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.admissible import smallest_margins
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.boundary import boundary_between, posture_of, straight_motion
from excite_cli.excitation.gradient_check import central_differences, relative_error
from excite_cli.excitation.random_baseline import random_baseline
from excite_cli.excitation.start import random_direction, random_start
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.base import Array, Trajectory
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.excitation.smoke import one_motion, smoke, task_of
from tests.robot.random_robots import random_robot

BRIEF = ("sampling={}", "optimizer.max_iterations=20")
SPLINE = (
    "trajectory={family: bspline, duration: 6, control_points: 14, start: posture, "
    "end: {shoulder_pitch: -0.5, elbow: 1.5}}"
)


def _task(*settings: str) -> MotionTask:
    return task_of(*BRIEF, *settings)


SERIES = (
    "trajectory={family: fourier, harmonics: 4, base_frequency: 1.0471975511965976, "
    "at_rest: true, start: {elbow: 0.5}}"
)


def _ends(trajectory: Trajectory, coefficients: Array) -> tuple[Array, Array, Array]:
    return trajectory.states(np.array([0.0, trajectory.duration]), coefficients)


@settings(max_examples=30, derandomize=True, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    points=st.integers(10, 40),
    degree=st.integers(3, 7),
    which=st.sampled_from(["both", "start", "end"]),
)
def test_any_spline_of_the_set_starts_and_ends_there_at_rest(
    seed: int, points: int, degree: int, which: str
) -> None:
    robot = random_robot(seed % 7, joints=4)
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(robot.limits.lower, robot.limits.upper, (2, robot.n))
    trajectory = BSplineTrajectory(rng.uniform(2, 20), max(points, degree + 5), degree)
    given_ends = (None if which == "end" else start, None if which == "start" else end)
    boundary = boundary_between(trajectory, *given_ends, robot.n)
    beta = rng.normal(size=(boundary.free.shape[1], robot.n))
    q, v, a = _ends(trajectory, boundary.offset + boundary.free @ beta)
    assert which == "end" or np.abs(q[0] - start).max() < 1e-9
    assert which == "start" or np.abs(q[1] - end).max() < 1e-9
    assert max(np.abs(v).max(), np.abs(a).max()) < 1e-9
    assert np.allclose(boundary.free.T @ boundary.free, np.eye(len(beta)))


@settings(max_examples=20, derandomize=True, deadline=None)
@given(seed=st.integers(0, 10_000), harmonics=st.integers(3, 12))
def test_any_series_of_the_set_starts_and_ends_there_at_rest(seed: int, harmonics: int) -> None:
    robot = random_robot(seed % 7, joints=4)
    rng = np.random.default_rng(seed)
    start = rng.uniform(robot.limits.lower, robot.limits.upper)
    trajectory = FourierTrajectory(harmonics, rng.uniform(0.3, 2.0), at_rest=True)
    boundary = boundary_between(trajectory, start, start, robot.n)
    beta = rng.normal(size=(boundary.free.shape[1], robot.n))
    q, v, a = _ends(trajectory, boundary.offset + boundary.free @ beta)
    assert np.abs(q - start).max() < 1e-9
    assert max(np.abs(v).max(), np.abs(a).max()) < 1e-9
    assert boundary.free.shape[1] == 2 * harmonics + 1 - 3


def test_the_straight_motion_is_straight_and_accelerates_least() -> None:
    trajectory = BSplineTrajectory(5.0, 15)
    start, end = np.array([0.2, -1.0]), np.array([1.0, 1.5])
    boundary = boundary_between(trajectory, start, end, 2)
    basis = trajectory.basis(np.linspace(0, 5.0, 400))
    q, _, least = basis.states(straight_motion(trajectory, start, end))
    share = (q - start) / (end - start)
    assert np.allclose(share[:, 0], share[:, 1])
    assert np.all(np.diff(share[:, 0]) > -1e-9)
    rng = np.random.default_rng(0)
    for _ in range(20):
        other = boundary.offset + boundary.free @ (
            0.05 * rng.normal(size=(boundary.free.shape[1], 2))
        )
        assert np.sum(basis.states(other)[2] ** 2) > np.sum(least**2)


@pytest.mark.parametrize("family", [SPLINE, SERIES])
def test_the_gradient_of_the_cost_with_an_offset(family: str) -> None:
    task = _task(family)
    x = 0.5 * random_direction(task, np.random.default_rng(3))
    criterion = task.problem.criterion

    def cost(at: Array) -> float:
        return task.objective.value(task.coefficients(at), criterion)

    gradient = task.evaluation(x, criterion).gradient()
    assert relative_error(gradient, central_differences(cost, x)) < 1e-6
    assert np.allclose(task.variables(task.coefficients(x)), x)


@pytest.mark.parametrize("family", [SPLINE, SERIES])
def test_an_optimised_motion_keeps_its_ends_and_all_constraints(family: str) -> None:
    task = _task(family)
    problem = task.problem
    begin = random_start(task, base_motion(task, 1), (1, 1, 0))
    motion = one_motion(problem)
    (random,) = random_baseline(problem, 1, 1, 5, 0.0, lambda drawn, best: None).motions
    for each in (random, motion):
        q, v, a = _ends(problem.trajectory, each.coefficients)
        assert np.abs(q - problem.boundary.postures).max() < 1e-9
    assert max(np.abs(v).max(), np.abs(a).max()) < 1e-9
    times = np.linspace(0.0, problem.trajectory.duration, 6001)
    assert all(m.min() >= 0 for m in smallest_margins(problem, motion.coefficients, times))
    before = task.objective.own_condition_number(task.coefficients(begin))
    assert motion.condition_number < 0.5 * before


def test_a_posture_near_a_bound_is_not_moved() -> None:
    """A margin far below what a start without given ends asks for."""
    series = SERIES.replace("elbow: 0.5", "elbow: 2.595, shoulder_pitch: -0.4")
    task = _task(series, "constraints.self_collision=null")
    assert base_motion(task, 1).posture[2] == 2.595
    motion = one_motion(task.problem)
    q, _, _ = _ends(task.problem.trajectory, motion.coefficients)
    assert np.abs(q[:, 2] - 2.595).max() < 1e-9
    assert motion.margins["joint_position"].violations == 0


@pytest.mark.parametrize(
    ("trajectory", "words"),
    [
        (
            SERIES.replace("elbow: 0.5", "shoulder_pitch: 2.1, elbow: 2.5"),
            r"(?s)trajectory\.start.*self_collision.* m\b",
        ),
        (SPLINE.replace("duration: 6", "duration: 0.6"), r"within 0\.6 s.*longer trajectory"),
    ],
    ids=["a posture that is not clear", "a way too long for the time"],
)
def test_what_cannot_begin_is_told(trajectory: str, words: str) -> None:
    with pytest.raises(NoAdmissibleMotionError, match=words):
        base_motion(_task(trajectory), 1)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ("{elbov: 0.5}", "Did you mean 'elbow'"),
        ("{elbow: 9}", r"trajectory.start.elbow: 9 is outside its limits \[-2.6, 2.6\]"),
    ],
)
def test_postures_by_name(start: str, message: str) -> None:
    """Joints that are not named are at the posture."""
    with pytest.raises(ConfigError, match=message):
        smoke(*BRIEF, SERIES.replace("{elbow: 0.5}", start))
    robot = smoke(*BRIEF).robot
    assert np.array_equal(posture_of(robot, "posture", "here"), robot.posture)
    wanted = robot.posture.copy()
    wanted[2] = -1.0
    assert np.array_equal(posture_of(robot, {"elbow": -1.0}, "here"), wanted)
