"""Starts and random candidates spread over workers give what one process gives, bit by bit."""

import os
import pickle
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.config.spec import SequenceSpec
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation import generate
from excite_cli.excitation.motion import Motion, Outcome
from excite_cli.excitation.one_start import FoundMotion, Search
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.progress import Figure, Measure, Progress, Status
from excite_cli.excitation.random_baseline import RandomBaseline, random_baseline
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.stack import Stack
from excite_cli.workers.base import Workers
from excite_cli.workers.here import Here
from excite_cli.workers.processes import Processes

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
STARTS = 3


def _problem(*settings: str) -> Problem:
    few = ["optimizer.max_iterations=3", "constraints.self_collision=null"]
    common = [*few, "constraints.torque=null", "sampling.constraints={samples: 61, step: 0.1}"]
    return build_problem(load_spec(CONFIG, [*common, *settings]), CONFIG.parent)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return _problem(f"optimizer.restarts={STARTS}", "optimizer.max_seconds=600")


@pytest.fixture(scope="module")
def two() -> Iterator[Processes]:
    with Processes(2) as workers:
        yield workers


def _motions(problem: Problem, workers: Workers, told: list[Progress]) -> tuple[Motion, ...]:
    result = continue_run(
        problem,
        new_result(problem, [], {}),
        lambda index: told.append,
        lambda step, current: None,
        workers=workers,
    )
    return result.motions


def _bare(motion: Motion) -> tuple[bytes, dict[str, Any]]:
    # The digest is of the config too, which one test changes.
    rest = {**vars(motion), "coefficients": None, "seconds": None, "digest": None}
    return motion.coefficients.tobytes(), rest


@pytest.fixture(scope="module")
def alone(problem: Problem) -> tuple[Motion, ...]:
    return _motions(problem, Here(), [])


def test_two_workers_find_the_same(
    problem: Problem, alone: tuple[Motion, ...], two: Processes
) -> None:
    told: list[Progress] = []
    found = _motions(problem, two, told)
    assert [_bare(motion) for motion in found] == [_bare(motion) for motion in alone]
    counts = [each.starts for each in told if each.starts is not None]
    assert {(c.done, c.total) for c in counts} >= {(k, STARTS) for k in range(1, STARTS + 1)}
    most = problem.spec.optimizer.max_iterations * STARTS
    assert max(c.iterations for c in counts) == most


def test_a_worker_killed_on_the_way_changes_nothing(
    problem: Problem, alone: tuple[Motion, ...], two: Processes
) -> None:
    killed: list[int] = []

    class Told(list[Progress]):
        def append(self, progress: Progress) -> None:
            if not killed:  # the first word: somebody is in the middle of a start
                killed.append(two.pids[0])
                os.kill(killed[0], signal.SIGKILL)

    first = replace(problem, spec=problem.spec.model_copy(update={"sequence": SequenceSpec()}))
    (found,) = _motions(first, two, Told())
    assert killed
    assert killed[0] not in two.pids
    assert _bare(found) == _bare(alone[0])


def test_random_candidates_do_not_depend_on_who_draws(two: Processes) -> None:
    problem = _problem()

    def drawn(workers: Workers) -> RandomBaseline:
        return random_baseline(problem, 2, 1, 11, 0.0, lambda drawn, best: None, None, workers)

    first, second = drawn(Here()), drawn(two)
    assert (first.candidates, first.admissible) == (second.candidates, second.admissible)
    assert first.candidates == 11
    for one, other in zip(first.motions, second.motions, strict=True):
        assert one.coefficients.tobytes() == other.coefficients.tobytes()
        assert one.stacked_condition_number == other.stacked_condition_number


class _Given(Workers):
    """Answers with outcomes made up for the purpose."""

    def __init__(self, found: list[Any]) -> None:
        self.found = found

    @property
    def count(self) -> int:
        return 1

    def map(self, *arguments: Any, **options: Any) -> list[Any]:
        return self.found

    def close(self) -> None:
        pass


def _best(problem: Problem, found: list[Any], alone: tuple[Motion, ...]) -> Motion:
    solver, stack = InteriorPoint(), Stack.empty(problem.columns)
    return generate.generate_motion(
        problem, solver, stack, 1, 1, lambda progress: None, None, _Given(found)
    )


def _found(value: float, x: Any, status: Any = Status.CONVERGED) -> FoundMotion:
    return FoundMotion(
        value, Figure(Measure.CONDITION_NUMBER, value), Outcome(x, status, 10, 20), 0.0
    )


def test_of_equal_starts_the_first_is_taken_and_failures_are_passed_over(
    problem: Problem, alone: tuple[Motion, ...]
) -> None:
    from excite_cli.excitation.task import MotionTask

    x = MotionTask(problem).variables(alone[0].coefficients)
    failure = NoAdmissibleMotionError("nothing here")
    found = [failure, _found(1.0, 0.5 * x), _found(1.0, x)]
    motion = _best(problem, found, alone)
    half = MotionTask(problem).coefficients(0.5 * x)
    assert np.array_equal(motion.coefficients, half)
    assert (motion.iterations, motion.evaluations) == (20, 40)
    assert motion.note == ""
    with pytest.raises(NoAdmissibleMotionError, match="nothing here"):
        _best(problem, [failure] * STARTS, alone)


def test_what_is_not_a_number_is_never_the_best(
    problem: Problem, alone: tuple[Motion, ...]
) -> None:
    from excite_cli.excitation.task import MotionTask

    x = MotionTask(problem).variables(alone[0].coefficients)
    motion = _best(problem, [_found(np.nan, 0.5 * x), *[_found(9.0, x)] * 2], alone)
    assert np.array_equal(motion.coefficients, MotionTask(problem).coefficients(x))


def test_starts_cut_short_by_time_are_told(problem: Problem, alone: tuple[Motion, ...]) -> None:
    from excite_cli.excitation.task import MotionTask

    x = MotionTask(problem).variables(alone[0].coefficients)
    found = [_found(1.0, x), _found(2.0, x, Status.TIME_LIMIT), _found(2.0, x, Status.TIME_LIMIT)]
    assert "2 of 3 starts ended at optimizer.max_seconds" in _best(problem, found, alone).note


@pytest.mark.parametrize(
    "settings",
    [
        ["optimizer.tolerance=0.01"],
        ["criterion.kind=log_det", "effects=[{kind: viscous_friction}]"],
        ["trajectory={family: bspline, start: posture, end: posture, duration: 6.0}"],
    ],
)
def test_whatever_a_problem_holds_can_travel(settings: list[str]) -> None:
    problem = _problem(*settings)
    search = Search(problem, InteriorPoint())
    there = pickle.loads(pickle.dumps(search))
    assert type(there.solver) is type(search.solver)
    again = there.problem
    rng = np.random.default_rng(1)
    alpha = 0.1 * rng.normal(size=(problem.trajectory.n_coefficients, problem.robot.n))
    for first, second in zip(problem.constraints, again.constraints, strict=True):
        here, copied = first.margins(problem.states(alpha)), second.margins(again.states(alpha))
        assert np.array_equal(here, copied), first.name
    one = problem.objective().value_and_gradient(alpha, problem.criterion)
    other = again.objective().value_and_gradient(alpha, again.criterion)
    assert one[0] == other[0]
    assert np.array_equal(one[1], other[1])


def test_progress_of_one_start_is_told_as_it_is() -> None:
    single = _problem("sequence.motions=1", "optimizer.restarts=1")
    told: list[Progress] = []
    _motions(single, Here(), told)
    assert told
    assert all(progress == replace(progress, starts=None) for progress in told)
