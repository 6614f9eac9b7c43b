"""One admissible motion: the best of its starts, judged."""

import time
from dataclasses import replace

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.admissible import verdicts, worst_margins
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.given_start import start_from
from excite_cli.excitation.motion import Motion, Outcome
from excite_cli.excitation.one_start import FoundMotion, OneStart, Search, solve_start
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import ProgressCallback, Status
from excite_cli.excitation.solvers.base import Solver
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import Start, moved_note
from excite_cli.excitation.start_progress import followed
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.chain import Segment
from excite_cli.workers.base import Workers
from excite_cli.workers.here import Here

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
    """Motion `index` on top of `stack`, the best of `optimizer.restarts` starts.

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

    Also what to report of it. Of equal ones the first is taken, so that it does not matter who
    was ready first. A start that fails is passed over; the last error is raised only if all fail.
    """
    restarts = task.problem.spec.optimizer.restarts
    tasks = [
        OneStart(task.stack, start, (*seed, number), first if number == 0 else None)
        for number in range(restarts)
    ]
    watch = followed(report, task.problem, restarts)
    ended = workers.map(solve_start, Search(task.problem, solver), tasks, watch)
    found = [each for each in ended if isinstance(each, FoundMotion)]
    if not found:
        raise ended[-1]
    best = min(found, key=_rank).outcome
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


def _rank(found: FoundMotion) -> float:
    """The criterion; what is not a number comes last, instead of being lower than nothing."""
    return np.inf if np.isnan(found.value) else found.value


def is_improvement(task: MotionTask, value: float) -> bool:
    """Whether the criterion fell noticeably below its value for the earlier data alone."""
    sigma = task.objective.earlier()
    if task.stack.rows == 0 or sigma[-1] <= np.finfo(float).eps * sigma[0]:
        return True
    return value < task.problem.criterion.value(sigma) - _IMPROVEMENT
