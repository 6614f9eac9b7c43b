"""The best of several starts: spread over workers, mended between instants, and interrupted.

What is spread over workers is what one process finds, bit by bit.
"""

import os
import pickle
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from excite_cli.api.planning import plan
from excite_cli.config.spec import SequenceSpec
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation import one_start, sequence
from excite_cli.excitation.motion import Motion, Outcome
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.one_start import FoundMotion, StartContext
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Figure, Progress, ProgressMeasure, Status
from excite_cli.excitation.random_baseline import RandomBaseline, _select, random_baseline
from excite_cli.excitation.solvers.base import Effort
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.start import clear_posture, random_start
from excite_cli.excitation.task import MotionTask
from excite_cli.store.result_file import read_result
from excite_cli.workers.base import Here, Workers
from excite_cli.workers.context import open_workers
from excite_cli.workers.processes import Processes
from tests.excitation.smoke import drawn, planned, smoke, task_of

STARTS = 3


def quick(*settings: str) -> Problem:
    few = ("optimizer.max_iterations=3", "sampling.constraints={samples: 61, step: 0.1}")
    return smoke(*few, "constraints.self_collision=null", "constraints.torque=null", *settings)


def _motions(problem: Problem, workers: Workers, told: list[Progress]) -> tuple[Motion, ...]:
    return planned(problem, report=lambda index: told.append, workers=workers).motions


@pytest.fixture(scope="module")
def problem() -> Problem:
    return quick(f"optimizer.restarts={STARTS}", "optimizer.max_seconds=600")


@pytest.fixture(scope="module")
def two() -> Iterator[Processes]:
    with Processes(2) as workers:
        yield workers


def _bare(motion: Motion) -> tuple[bytes, dict[str, Any]]:
    # The digest is of the config too, which one test changes.
    rest = {**vars(motion), "coefficients": None, "seconds": None, "digest": None}
    return motion.coefficients.tobytes(), rest


@pytest.fixture(scope="module")
def alone(problem: Problem) -> tuple[Motion, ...]:
    return _motions(problem, Here(), [])


@pytest.mark.long
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


@pytest.mark.long
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
    problem = quick()

    def drawn(workers: Workers) -> RandomBaseline:
        return random_baseline(problem, 2, 1, 11, 0.0, lambda drawn, best: None, None, workers)

    first, second = drawn(Here()), drawn(two)
    assert (first.candidates, first.admissible) == (second.candidates, second.admissible)
    assert first.candidates == 11
    for one, other in zip(first.motions, second.motions, strict=True):
        assert one.coefficients.tobytes() == other.coefficients.tobytes()
        assert one.stacked_condition_number == other.stacked_condition_number


def outcome(value: float, x: Any, status: Any = Status.CONVERGED) -> FoundMotion:
    return FoundMotion(
        value, Figure(ProgressMeasure.CONDITION_NUMBER, value), Outcome(x, status, 10, 20), 0.0
    )


def test_the_best_of_several_starts(problem: Problem) -> None:
    """Of equal ones the first; failures, and what is no number, never."""
    task = MotionTask(problem)
    x = random_start(task, clear_posture(task, 1), (1, 1))

    def best(*found: Any) -> Motion:
        class Given(Here):
            def map(self, *arguments: Any, **options: Any) -> list[Any]:
                return [*found]

        solver, stack = InteriorPoint(), Stack.empty(problem.columns)
        return sequence.generate_motion(problem, solver, stack, 1, 1, print, None, Given())

    failure = NoAdmissibleMotionError("nothing here")
    motion = best(failure, outcome(1.0, 0.5 * x), outcome(1.0, x))
    assert np.array_equal(motion.coefficients, task.coefficients(0.5 * x))
    assert (motion.iterations, motion.evaluations) == (20, 40)
    assert motion.note == ""
    with pytest.raises(NoAdmissibleMotionError, match="nothing here"):
        best(*[failure] * STARTS)
    motion = best(outcome(np.nan, 0.5 * x), *[outcome(9.0, x)] * 2)
    assert np.array_equal(motion.coefficients, task.coefficients(x))
    late = [outcome(2.0, x, Status.TIME_LIMIT)] * 2
    assert "2 of 3 starts ended at optimizer.max_seconds" in best(outcome(1.0, x), *late).note


@pytest.mark.parametrize(
    "settings",
    [
        ["optimizer.tolerance=0.01"],
        ["criterion.kind=log_det", "effects=[{kind: viscous_friction}]"],
        ["trajectory={family: bspline, start: posture, end: posture, duration: 6.0}"],
    ],
)
def test_whatever_a_problem_holds_can_travel(settings: list[str]) -> None:
    problem = quick(*settings)
    search = StartContext(problem, InteriorPoint())
    there = pickle.loads(pickle.dumps(search))
    assert type(there.solver) is type(search.solver)
    alpha = drawn(problem, 0.1)
    for first, second in zip(problem.constraints, there.problem.constraints, strict=True):
        here, copied = (each.margins(problem.states(alpha)) for each in (first, second))
        assert np.array_equal(here, copied), first.name
    one, other = (
        each.objective().value_and_gradient(alpha, each.criterion)
        for each in (problem, there.problem)
    )
    assert one[0] == other[0]
    assert np.array_equal(one[1], other[1])


def test_progress_of_one_start_is_told_as_it_is() -> None:
    single = quick("sequence.motions=1", "optimizer.restarts=1")
    told: list[Progress] = []
    _motions(single, Here(), told)
    assert told
    assert all(progress == replace(progress, starts=None) for progress in told)


def kept(monkeypatch: pytest.MonkeyPatch, needed: float, told: float) -> list[float]:
    """By how much the guard of the first column was raised, round by round.

    The proof stands aside: the column lacks `told`, or what is left to `needed` if that is less.
    """
    task = task_of()
    start = clear_posture(task, 1)
    first, raised = float(task.guards[0][0]), [0.0]

    class Solver:
        polish = 0

        def solve(self, tighter: MotionTask, x: Any, *_: Any) -> Outcome:
            raised.append(float(tighter.guards[0][0]) - first)
            return Outcome(x, Status.CONVERGED, 1, 1)

    def lacking(*_: Any) -> list[Any]:
        found = [np.zeros_like(guard) for guard in task.guards]
        found[0][0] = min(told, max(needed - raised[-1], 0.0))
        return found

    monkeypatch.setattr(one_start, "lacking_margins", lacking)
    begin = Outcome(random_start(task, start, (1, 1, 0)), Status.CONVERGED, 1, 1)
    effort = Effort(80, 4.0, 1e-6)
    one_start.kept_between_instants(task, Solver(), start, begin, effort, lambda told: None)
    return raised


def test_room_between_instants_grows_as_it_must(monkeypatch: pytest.MonkeyPatch) -> None:
    """A trifle that stays a trifle is given more each time, what lacks less what it lacks."""
    raised = kept(monkeypatch, needed=2e-3, told=1e-5)
    assert raised[-1] > 2e-3
    assert len(raised) <= 6
    steps = np.diff(raised)
    np.testing.assert_allclose(steps[1:] / steps[:-1], 4.0)
    raised = kept(monkeypatch, needed=2e-3, told=1.6e-3)
    np.testing.assert_allclose(raised, [0.0, 1.3 * 1.6e-3])
    with pytest.raises(NoAdmissibleMotionError, match="kept admissible between the instants"):
        kept(monkeypatch, needed=0.1, told=1e-6)


def slow(*settings: str) -> Problem:
    common = ("constraints.torque=null", "optimizer.max_iterations=60", "optimizer.restarts=1")
    return smoke(*common, "sequence.motions=2", *settings)


@pytest.mark.parametrize("motion", [1, 2])
def test_the_best_so_far_is_stored_and_made_anew(tmp_path: Path, motion: int) -> None:
    problem, path = slow(), tmp_path / "cut.h5"
    seen: list[float] = []

    def report(index: int, progress: Progress) -> None:
        if index == motion:
            seen.append(progress.figure.value)
        if len(seen) == 25:  # Ctrl-C
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plan(problem, output=path, progress=report)
    left = read_result(path)
    assert len(left.motions) == motion
    last = left.motions[-1]
    assert last.status is Status.INTERRUPTED
    assert last.iterations >= 25
    assert all(last.certified.values())
    assert last.stacked_condition_number < 1.3 * min(seen)
    resumed = plan(problem, output=path, resume=True)
    whole = plan(problem)
    assert [m.status for m in resumed.motions] == [m.status for m in whole.motions]
    for own, other in zip(resumed.motions, whole.motions, strict=True):
        np.testing.assert_array_equal(own.coefficients, other.coefficients)
    np.testing.assert_array_equal(resumed.stack.factor, whole.stack.factor)


@pytest.mark.long
def test_of_several_starts_it_is_the_best(tmp_path: Path) -> None:
    """Also of those that other processes have told before they were ended."""
    problem, path = slow("optimizer.restarts=4"), tmp_path / "cut.h5"
    figures: list[float] = []

    def report(index: int, progress: Progress) -> None:
        if progress.stage is not None and progress.stage.number == 0:
            figures.append(progress.figure.value)
            if len(figures) == 3:
                raise KeyboardInterrupt

    with open_workers(2) as workers, pytest.raises(KeyboardInterrupt):
        plan(problem, output=path, progress=report, workers=workers)
    (motion,) = read_result(path).motions
    assert motion.status is Status.INTERRUPTED
    assert motion.condition_number < 1.05 * min(figures)


def test_without_an_admissible_point_nothing_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted = Mock(side_effect=KeyboardInterrupt)
    monkeypatch.setattr("excite_cli.excitation.one_start.random_start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        plan(slow(), output=tmp_path / "cut.h5")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("seed", range(5))
def test_no_other_motion_in_place_of_a_selected_one_is_better(seed: int) -> None:
    blocks = np.random.default_rng(seed).normal(size=(30, 5, 4)) * [1.0, 2.0, 0.3, 0.1]
    grams = blocks.swapaxes(1, 2) @ blocks

    def condition(some: list[int]) -> float:
        return float(np.linalg.cond(np.vstack(blocks[some])))

    def figures(grams: Any) -> Any:
        return np.linalg.cond(grams) ** 0.5

    chosen = _select(figures, grams, np.zeros((4, 4)), 4)
    own = condition(chosen)
    for slot in range(4):
        for other in range(30):
            assert own <= condition([*chosen[:slot], other, *chosen[slot + 1 :]]) * (1 + 1e-6)
