"""The search starts from a motion of others: itself where it fits, the nearest admissible else."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.planned_prior import planned_stack
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.start import random_start, start_from
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.bspline import BSplineTrajectory
from excite_cli.trajectory.fade import Segment
from excite_cli.trajectory.sampled import through_samples

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
LOOSE = ("constraints.self_collision=null",)


def _task(*settings: str) -> MotionTask:
    return MotionTask(build_problem(load_spec(CONFIG, [*LOOSE, *settings]), CONFIG.parent))


def _motion(task: MotionTask, factor: float = 1.0, count: int = 601) -> Segment:
    """An admissible motion of the task, its deviation from the base times `factor`, as samples."""
    start = base_motion(task, 1)
    x = start.base + factor * (random_start(task, start, (1, 1)) - start.base)
    trajectory = task.problem.trajectory
    t = np.linspace(0.0, trajectory.duration, count)
    states = trajectory.states(t, task.coefficients(x))
    return Segment("given", *through_samples(t, *states))


def _smallest(task: MotionTask, x: np.ndarray) -> float:
    return min(float(value.min()) for value in task.values(task.states(x)))


@pytest.mark.parametrize("rest", ["true", "false"])
def test_an_admissible_motion_is_taken_as_it_is(rest: str) -> None:
    task = _task(f"trajectory.at_rest={rest}")
    start = base_motion(task, 1)
    x, words = start_from(task, start, _motion(task))
    assert x == pytest.approx(random_start(task, start, (1, 1)), abs=1e-6)
    assert words == "the search started from given"


def test_one_that_breaks_limits_is_drawn_in_and_this_is_said() -> None:
    task = _task()
    x, words = start_from(task, base_motion(task, 1), _motion(task, factor=5.0))
    assert _smallest(task, x) > 0
    assert "of its amplitude to be admissible" in words
    share = float(words.split("drawn to ")[1].split(" %")[0])
    assert 5 < share < 60


def test_another_duration_is_stretched_and_a_path_of_others_followed_as_far_as_it_goes() -> None:
    task = _task()
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
    ends = (
        "trajectory={family: bspline, duration: 6, control_points: 14, start: posture, "
        "end: {elbow: 0.5}}"
    )
    task = _task(ends)
    start = base_motion(task, 1)
    given = _motion(_task("trajectory={family: bspline, duration: 6, control_points: 14}"))
    x, _ = start_from(task, start, given)
    assert _smallest(task, x) > 0
    q, v, _ = task.problem.trajectory.states(np.array([0.0, 6.0]), task.coefficients(x))
    assert q[0] == pytest.approx(task.problem.robot.posture, abs=1e-9)
    assert q[1][2] == pytest.approx(0.5, abs=1e-9)
    assert v == pytest.approx(np.zeros((2, 5)), abs=1e-9)


def test_what_cannot_be_admissible_is_refused_by_name() -> None:
    task = _task()
    start = base_motion(task, 1)
    given = _motion(task, factor=1e6)
    with pytest.raises(NoAdmissibleMotionError, match="--start given: no admissible start"):
        start_from(task, start, given)


def test_a_planned_motion_is_stacked_as_the_motion_that_it_is() -> None:
    task = _task()
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
    problem = build_problem(
        load_spec(CONFIG, ["sequence.motions=1", f"optimizer.restarts={restarts}"]), CONFIG.parent
    )

    def planned(starts: list[Segment]) -> Motion:
        told = continue_run(
            problem,
            new_result(problem, [], {}),
            lambda index: lambda progress: None,
            lambda step, result: None,
            starts=starts,
        )
        return told.motions[0]

    first = planned([])
    again = planned([Segment("first", problem.trajectory, first.coefficients)])
    assert again.condition_number < 1.02 * first.condition_number
    if restarts == 1:
        assert again.iterations < 0.8 * first.iterations
