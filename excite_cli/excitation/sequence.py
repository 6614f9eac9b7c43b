"""Motions one after the other, each with all earlier ones stacked as C_0 (Eq. 41, section IV.B)."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.spec import SequenceSpec
from excite_cli.constraints.base import Array
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.admissible import verdicts, worst_margins
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.motion import Motion, Outcome
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.one_start import (
    FoundMotion,
    OneStart,
    StartContext,
    StoppedError,
    interrupted,
    solve_start,
)
from excite_cli.excitation.problem import Problem, with_cost_on
from excite_cli.excitation.progress import Progress, ProgressCallback, Stage, Starts, Status
from excite_cli.excitation.solvers.base import Solver
from excite_cli.excitation.start import Start, moved_note, start_from
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Here, News, Watch, Workers

# One admissible motion: the best of its starts, judged.

# Beyond this condition number some parameters do not show at all.
_BLIND = 1e9
# A motion counts as an improvement of the stack from this change of the (logarithmic) criterion.
_IMPROVEMENT = 1e-3


def generate_motion(
    problem: Problem,
    solver: Solver,
    stack: Stack,
    index: int,
    seed: int,
    report: ProgressCallback,
    given: Segment | None = None,
    workers: Workers | None = None,
) -> Motion:
    """Motion `index` on top of `stack`, the best of several starts.

    The first start is made of the motion `given`, if there is one. Starts are spread over
    `workers` (default: done here); the motion is the same wherever they are done.

    Raises
    ------
    NoAdmissibleMotionError
        No start is admissible, or the result cannot be kept admissible between the instants.
    """
    began = time.perf_counter()
    task = MotionTask(problem, stack)
    start = base_motion(task, seed)
    first, told = (None, "") if given is None else start_from(task, start, given)
    outcome, cut = _best_of_starts(
        task, solver, start, (seed, index), report, first, workers or Here()
    )
    coefficients = task.coefficients(outcome.x)
    value = task.objective.value(coefficients, problem.criterion)
    stacked = task.objective.stacked_condition_number(coefficients)
    if task.objective.must_show_all and not stacked < _BLIND:
        effects = len(problem.extension.names)
        beside = f" and {effects} of effects" if effects else ""
        raise NoAdmissibleMotionError(
            f"No motion found that shows all {problem.base.rank} base parameters{beside} "
            f"(condition number {stacked:.1e}). Give the trajectory more coefficients, or wider "
            "limits and sampling."
        )
    return Motion(
        index=index,
        coefficients=coefficients,
        condition_number=task.objective.own_condition_number(coefficients),
        stacked_condition_number=stacked,
        improved=is_improvement(task, value),
        status=outcome.status,
        seconds=time.perf_counter() - began,
        iterations=outcome.iterations,
        evaluations=outcome.evaluations,
        margins=worst_margins(problem, coefficients),
        certified=_certified(problem, coefficients),
        dense_condition_number=dense_condition_number(problem, stack, coefficients),
        predicted_deviation=task.objective.deviation_with(
            task.objective.added_to(stack, coefficients)
        ),
        note="; ".join(filter(None, [moved_note(task, start), told, cut])),
    )


def _certified(problem: Problem, coefficients: Array) -> dict[str, bool]:
    if not problem.spec.optimizer.certify:
        return {}
    return {verdict.name: verdict.proved for verdict in verdicts(problem, coefficients)}


def _best_of_starts(
    task: MotionTask,
    solver: Solver,
    start: Start,
    seed: tuple[int, int],
    report: ProgressCallback,
    first: Array | None,
    workers: Workers,
) -> tuple[Outcome, str]:
    """The outcome with the lowest criterion, with iterations and evaluations of all starts.

    Also what to report of it. Starts are told apart early (successive halving): after some stages
    the better half goes on, then a quarter of it to the end, and the first one in any case, so that
    several starts are never worse than one. Of equal ones the first is taken, so that it does not
    matter who was ready first. A start that fails is passed over; the last error
    is raised only if all fail. A `first` motion is gone on with, and begun with anew as well.
    Where the search is interrupted, the outcome is the best so far.
    """
    restarts = task.problem.restarts
    tasks = [OneStart(task.stack, start, (*seed, number)) for number in range(restarts)]
    if first is not None:
        tasks[0] = replace(tasks[0], first=first, begin=solver.polish)
        if restarts > 1:
            tasks[1] = replace(tasks[1], first=first)
    search = StartContext(task.problem, solver)
    ended, found = _told_apart(search, tasks, report, workers)
    best = min(ended, key=_rank).outcome
    cut = sum(each.outcome.status is Status.TIME_LIMIT for each in found)
    told = ""
    if cut and best.status is not Status.TIME_LIMIT:
        told = (
            f"{cut} of {restarts} starts ended at optimizer.max_seconds, so another run may find "
            "another best one; raise it"
        )
    return (
        replace(
            best,
            iterations=sum(each.outcome.iterations for each in found),
            evaluations=sum(each.outcome.evaluations for each in found),
        ),
        told,
    )


def _told_apart(
    search: StartContext, tasks: Sequence[OneStart], report: ProgressCallback, workers: Workers
) -> tuple[list[FoundMotion], list[FoundMotion]]:
    """Starts that were gone on with to the end, and the last that is known of every one.

    Raises
    ------
    NoAdmissibleMotionError
        None of them led anywhere.
    """
    error = NoAdmissibleMotionError("No start was made.")
    last: dict[int, FoundMotion] = {}
    known: dict[int, FoundMotion] = {}

    def best(count: int) -> list[int]:
        return sorted(sorted(last, key=lambda k: (_rank(last[k]), k))[:count])

    def go_on(numbers: Sequence[int], until: int | None) -> None:
        nonlocal error
        going = [k for k in numbers if k not in last or last[k].stages is not None]
        if not going:
            return
        asked = [_task(tasks[k], last.get(k), until) for k in going]
        follow = _followed(report, search.problem, len(going))

        def watch(news: News) -> None:
            if isinstance(news.result, FoundMotion):
                known[going[news.index]] = news.result
            follow(news)

        for k, result in zip(going, workers.map(solve_start, search, asked, watch), strict=True):
            last.pop(k, None)
            if isinstance(result, FoundMotion):
                last[k] = result
            else:
                error = result

    try:
        alive = list(range(len(tasks)))
        for number, stages in enumerate(search.solver.told_apart if len(tasks) > 1 else ()):
            go_on(alive, stages)
            kept = max(2, -(-len(alive) // 2)) if number == 0 else -(-len(alive) // 4)
            alive = sorted({*best(kept), *(set(alive[:1]) & last.keys())})
        go_on(alive, None)
        while last and all(found.stages is not None for found in last.values()):
            go_on(best(1), None)  # those that were gone on with led nowhere
    except KeyboardInterrupt as stop:
        so_far = [*known.values(), *([stop.found] if isinstance(stop, StoppedError) else [])]
        if not so_far:
            raise
        try:
            found = interrupted(search, tasks[0], min(so_far, key=_rank))
        except NoAdmissibleMotionError:
            raise stop from None
        return [found], [*known.values(), found]
    if not last:
        raise error
    ended = [last[k] for k in sorted(last) if last[k].stages is None]
    return ended, list(last.values())


def _task(task: OneStart, found: FoundMotion | None, until: int | None) -> OneStart:
    """The task up to `until`, where it does not begin later."""
    late = found is None and until is not None and task.begin >= until
    return replace(task, found=found, until=None if late else until)


def _rank(found: FoundMotion) -> float:
    """The criterion; what is not a number comes last, instead of being lower than nothing."""
    return np.inf if np.isnan(found.value) else found.value


def is_improvement(task: MotionTask, value: float) -> bool:
    """Whether the criterion fell noticeably below its value for the earlier data alone."""
    sigma = task.objective.earlier()
    if task.stack.rows == 0 or sigma[-1] <= np.finfo(float).eps * sigma[0]:
        return True
    return value < task.problem.criterion.value(sigma) - _IMPROVEMENT


def _followed(report: ProgressCallback, problem: Problem, starts: int) -> Watch:
    """Pass on what starts tell; where there are several, with how many of them are done."""
    most = problem.spec.optimizer.max_iterations
    iterations = [0] * starts

    def watch(news: News) -> None:
        told: Progress | None = news.word
        if isinstance(news.result, FoundMotion):  # its last point keeps all limits
            count = news.result.outcome.iterations
            told = Progress(count, news.result.figure, 0.0, news.result.seconds, Stage())
            iterations[news.index] = most
        elif told is not None:
            iterations[news.index] = min(told.iteration, most)
        if told is None or (starts == 1 and news.result is not None):
            return
        if starts > 1:
            total = sum(iterations)
            told = replace(told, starts=Starts(news.done, news.running, starts, total))
        report(told)

    return watch


@dataclass(frozen=True)
class FinishedMotion:
    """A finished motion and the stack that includes it."""

    motion: Motion
    stack: Stack


def generate_sequence(
    problem: Problem,
    solver: Solver,
    stack: Stack,
    indices: range,
    seed: int,
    report: Callable[[int], ProgressCallback],
    starts: Sequence[Segment] = (),
    workers: Workers | None = None,
) -> Iterator[FinishedMotion]:
    """Yield motions `indices` (counted from 1), starting on top of `stack`.

    Each motion depends on the stack, the seed and its index only, so a sequence that is resumed
    from a stored stack goes on to the same numbers. `report(index)` gives the progress callback.
    Motion k starts its search from the k-th of `starts`, as far as there are any. The starts of a
    motion are spread over `workers` (default: done here).
    """
    objective = problem.objective()
    for index in indices:
        given = starts[index - 1] if index <= len(starts) else None
        told = report(index)
        motion = generate_motion(problem, solver, stack, index, seed, told, given, workers)
        stack = objective.added_to(stack, motion.coefficients)
        yield FinishedMotion(motion, stack)


# How many motions a sequence has at most: a number is given, or the time is spent.

# Durations that agree to rounding are equal: three motions of 10 s are within 30 s.
_ROUNDING = 1e-9
_MOST = 20  # motions where a precision or a time is asked for, and no number


def most_motions(sequence: SequenceSpec) -> int:
    """Motions, or the most of them where `until` may end them earlier."""
    return sequence.motions or (1 if sequence.until is None else _MOST)


def motions_within(problem: Problem) -> int:
    """Motions that may be made in all, in the time of `sequence.until`.

    Raises
    ------
    ConfigError
        Not one motion is as short as `until.duration`.
    """
    sequence, duration = problem.spec.sequence, problem.trajectory.duration
    if sequence.until is None or sequence.until.duration is None:
        return most_motions(sequence)
    fitting = int(sequence.until.duration / duration * (1.0 + _ROUNDING))
    if fitting == 0:
        raise ConfigError(
            f"sequence.until.duration: one motion takes {duration:.4g} s, and the time of all is "
            f"{sequence.until.duration:g} s. Allow more, or give a shorter trajectory."
        )
    return min(fitting, most_motions(sequence))


# The condition number on a grid much finer than that of the cost, which a motion may be shaped
# to.
#
# With 40 samples for 21 coefficients, TALOS' arms had 5.15 on them and 5.56 on twenty times as
# many.

_FINER = 8
# From this ratio on, the cost's samples flatter.
_FLATTERED = 1.02


def dense_condition_number(problem: Problem, stack: Stack, coefficients: Array) -> float:
    """Condition number of the motion on top of `stack`, on eight times as many instants.

    The motion counts as much as on the grid of the cost: its rows are weighted by 8^(−1/2).
    """
    times = problem.cost_basis.times
    step = float(times[1] - times[0]) / _FINER if len(times) > 1 else 0.0
    fine: Array = step * np.arange(_FINER * len(times), dtype=float)
    fine = fine[fine <= problem.trajectory.duration]
    basis = problem.trajectory.basis(fine)
    dense = with_cost_on(replace(problem, separation=None), basis)
    return dense.objective(stack).stacked_condition_number(coefficients)


def flattered(stacked: float, dense: float | None) -> bool:
    """Whether the figure on the grid of the cost says less than it is between its samples."""
    return dense is not None and dense > _FLATTERED * stacked
