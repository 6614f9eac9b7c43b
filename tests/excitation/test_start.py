"""Starts are admissible by construction or from a motion of others, or what prevents it is said."""

import numpy as np
import pytest

from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.run import planned_stack
from excite_cli.excitation.start import clear_posture, random_direction, random_start, start_from
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fade import Segment
from excite_cli.trajectory.sampled import through_samples
from tests.excitation.smoke import planned, smoke, task_of


def loose(*settings: str) -> MotionTask:
    return task_of("constraints.self_collision=null", *settings)


@pytest.mark.parametrize("rest", ["true", "false"])
def test_random_start_is_strictly_admissible_and_seeded(rest: str) -> None:
    task = task_of(f"trajectory.at_rest={rest}")
    for seed in range(4):
        start = clear_posture(task, seed)
        x = random_start(task, start, (seed, 1))
        assert _smallest(task, x) > 0
        assert np.array_equal(x, random_start(task, start, (seed, 1)))
        assert not np.array_equal(x, random_start(task, start, (seed, 2)))


def test_a_clear_posture_is_kept_and_another_is_moved() -> None:
    assert clear_posture(task_of(), 1).as_configured
    folded = task_of("robot.posture={shoulder_pitch: 2.1, elbow: 2.5}")
    still = folded.problem.still
    assert _smallest(folded, folded.variables(still(folded.problem.robot.posture))) < 0
    found = clear_posture(folded, 1)
    assert not found.as_configured
    assert _smallest(folded, folded.variables(still(found.posture))) > 0


@pytest.mark.parametrize(
    ("setting", "name"),
    [
        ("constraints.balance={kind: disc, radius: 0.001, center: [9, 9]}", "balance"),
        ("constraints.self_collision.margin=5", "self_collision"),
        ("constraints.torque.scale=0.0001", "joint_torque"),
    ],
)
def test_what_stands_in_the_way_is_named(setting: str, name: str) -> None:
    with pytest.raises(NoAdmissibleMotionError, match=name):
        clear_posture(task_of(setting), 1)


def test_random_directions_have_unit_length_joint_by_joint() -> None:
    task = task_of()
    for slow in (0.0, 0.5, 1.0):
        x = random_direction(task, np.random.default_rng(3), slow)
        image = (task.metric @ x).reshape(task.n, task.k)
        lengths = np.einsum("jk,jk->j", x.reshape(task.n, task.k), image)
        assert np.allclose(lengths, 1.0)


def test_metric_is_the_mean_square_in_units_of_the_bounds() -> None:
    task = task_of("constraints.torque=null", "constraints.self_collision=null")
    rng = np.random.default_rng(0)
    x = random_direction(task, rng)
    states = task.states(x)
    limits, acceleration = task.problem.robot.limits, 10.0
    half = (limits.upper - limits.lower) / 2
    expected = np.mean((states.v / limits.velocity) ** 2 + (states.a / acceleration) ** 2, axis=0)
    bounded = np.isfinite(half)
    expected[bounded] += np.mean((states.q[:, bounded] / half[bounded]) ** 2, axis=0)
    expected += 1e-3 * np.mean(states.q**2, axis=0)  # so that joints without bounds count too
    assert x @ task.metric @ x == pytest.approx(expected.sum())


def _motion(task: MotionTask, factor: float = 1.0) -> Segment:
    """An admissible motion of the task, its deviation from the base times `factor`, as samples."""
    start = base_motion(task, 1)
    x = start.base + factor * (random_start(task, start, (1, 1)) - start.base)
    trajectory = task.problem.trajectory
    t = np.linspace(0.0, trajectory.duration, 601)
    states = trajectory.states(t, task.coefficients(x))
    return Segment("given", *through_samples(t, *states))


def _smallest(task: MotionTask, x: np.ndarray) -> float:
    return min(float(value.min()) for value in task.values(task.states(x)))


@pytest.mark.parametrize("rest", ["true", "false"])
def test_an_admissible_motion_is_taken_as_it_is(rest: str) -> None:
    task = loose(f"trajectory.at_rest={rest}")
    start = base_motion(task, 1)
    x, words = start_from(task, start, _motion(task))
    assert x == pytest.approx(random_start(task, start, (1, 1)), abs=1e-6)
    assert words == "the search started from given"


def test_one_that_breaks_limits_is_drawn_in_or_refused_by_name() -> None:
    task = loose()
    start = base_motion(task, 1)
    x, words = start_from(task, start, _motion(task, factor=5.0))
    assert _smallest(task, x) > 0
    assert "of its amplitude to be admissible" in words
    share = float(words.split("drawn to ")[1].split(" %")[0])
    assert 5 < share < 60
    with pytest.raises(NoAdmissibleMotionError, match="--start given: no admissible start"):
        start_from(task, start, _motion(task, factor=1e6))


def test_another_duration_is_stretched_and_a_path_of_others_followed_as_far_as_it_goes() -> None:
    task = loose()
    spline = BSplineTrajectory(9.0, 12)
    rng = np.random.default_rng(3)
    moved = spline.constant(task.problem.robot.posture)
    given = Segment("hand_made", spline, moved + 0.05 * rng.normal(size=moved.shape))
    x, words = start_from(task, base_motion(task, 1), given)
    assert "stretched from 9 to 6 s" in words
    assert "follows to" in words
    times = task.problem.constraint_basis.times
    wanted, _, _ = spline.states(times * 1.5, given.coefficients)
    found = task.states(x).q
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.03


def test_given_ends_stay_as_they_are() -> None:
    spline = "trajectory={{family: bspline, duration: 6, control_points: 14{}}}"
    task = loose(spline.format(", start: posture, end: {elbow: 0.5}"))
    x, _ = start_from(task, base_motion(task, 1), _motion(loose(spline.format(""))))
    assert _smallest(task, x) > 0
    q, v, _ = task.problem.trajectory.states(np.array([0.0, 6.0]), task.coefficients(x))
    assert q[0] == pytest.approx(task.problem.robot.posture, abs=1e-9)
    assert q[1][2] == pytest.approx(0.5, abs=1e-9)
    assert v == pytest.approx(np.zeros((2, 5)), abs=1e-9)


def test_a_planned_motion_is_stacked_as_the_motion_that_it_is() -> None:
    task = loose()
    problem, objective = task.problem, task.problem.objective()
    start = base_motion(task, 1)
    x = random_start(task, start, (1, 1))
    stack, words = planned_stack(problem, _motion(task))
    block = objective.block(task.coefficients(x))
    assert stack.rows == len(block)
    wanted = block.T @ block
    assert stack.factor.T @ stack.factor == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())
    assert words == "6 s of motion, 60 samples every 0.1 s (as the cost grid)"


@pytest.mark.parametrize("restarts", [1, 3])
def test_a_good_motion_is_gone_on_with(restarts: int) -> None:
    """The search does not begin at a high barrier with it, which would make it a random start."""
    problem = smoke("sequence.motions=1", f"optimizer.restarts={restarts}")
    (first,) = planned(problem, starts=[]).motions
    given = Segment("first", problem.trajectory, first.coefficients)
    (again,) = planned(problem, starts=[given]).motions
    assert again.condition_number < 1.02 * first.condition_number
    if restarts == 1:
        assert again.iterations < 0.8 * first.iterations
