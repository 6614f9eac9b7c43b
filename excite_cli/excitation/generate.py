"""One admissible motion: start, solve, look between the instants, mend, judge."""

import time
from dataclasses import replace

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.admissible import lacking_margins, verdicts, worst_margins
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.given_start import start_from
from excite_cli.excitation.motion import Motion, Outcome, Progress, ProgressCallback
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.solvers.base import Effort, Solver
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import Start, moved_note, random_start
from excite_cli.excitation.task import MotionTask
from excite_cli.trajectory.chain import Segment

_GUARD_ROUNDS = 6
_GUARD_GROWTH = 1.3
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
) -> Motion:
    """Motion `index` on top of `stack`, the best of `optimizer.restarts` starts.

    The first start is made of the motion `given`, if there is one.

    Raises
    ------
    NoAdmissibleMotionError
        No start is admissible, or the result cannot be kept admissible between the instants.
    """
    began = time.perf_counter()
    task = MotionTask(problem, stack)
    start = base_motion(task, seed)
    first, told = (None, "") if given is None else start_from(task, start, given)
    outcome = _best_of_starts(task, solver, start, (seed, index), report, first)
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
        note="; ".join(filter(None, [moved_note(task, start), told])),
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
    first: Array | None = None,
) -> Outcome:
    """The outcome with the lowest criterion, with iterations and evaluations of all starts.

    A start that fails is passed over; its error is raised only if all fail.
    """
    problem, spec = task.problem, task.problem.spec.optimizer
    effort = Effort(spec.max_iterations, spec.max_seconds, spec.tolerance)
    found: list[tuple[float, Outcome]] = []
    failure: NoAdmissibleMotionError | None = None
    for restart in range(spec.restarts):
        run = MotionTask(problem, task.stack)
        told = _labelled(report, restart, spec.restarts)
        try:
            x = first if first is not None and restart == 0 else None
            x = random_start(run, start, (*seed, restart)) if x is None else x
            outcome = solver.solve(run, x, effort, told)
            outcome = kept_between_instants(run, solver, start, outcome, effort, told)
        except NoAdmissibleMotionError as error:
            failure = error
            continue
        value = run.objective.value(run.coefficients(outcome.x), problem.criterion)
        found.append((value, outcome))
    if not found:
        assert failure is not None
        raise failure
    _, best = min(found, key=lambda pair: pair[0])
    return replace(
        best,
        iterations=sum(outcome.iterations for _, outcome in found),
        evaluations=sum(outcome.evaluations for _, outcome in found),
    )


def is_improvement(task: MotionTask, value: float) -> bool:
    """Whether the criterion fell noticeably below its value for the earlier data alone."""
    sigma = task.objective.earlier()
    if task.stack.rows == 0 or sigma[-1] <= np.finfo(float).eps * sigma[0]:
        return True
    return value < task.problem.criterion.value(sigma) - _IMPROVEMENT


def kept_between_instants(
    task: MotionTask,
    solver: Solver,
    start: Start,
    outcome: Outcome,
    effort: Effort,
    report: ProgressCallback,
) -> Outcome:
    """The outcome, mended until every constraint is proved between the instants.

    Where a margin is negative (without certificates: at controller rate) the guard of that column
    is raised by it, and the solver goes on from the nearest point towards the base motion that has
    the new guards.
    """
    problem = task.problem
    began = time.perf_counter()
    for round_ in range(_GUARD_ROUNDS + 1):
        lacking = lacking_margins(problem, task.coefficients(outcome.x))
        if not any(lack.any() for lack in lacking):
            return outcome
        if round_ == _GUARD_ROUNDS:
            break
        guards = [
            guard + _GUARD_GROWTH * lack for guard, lack in zip(task.guards, lacking, strict=True)
        ]
        tighter = task.with_guards(guards)
        inside = _drawn_inside(tighter, outcome.x, start)
        short = Effort(
            max_iterations=max(10, effort.max_iterations // 8),
            max_seconds=max(1.0, effort.max_seconds / 4 - (time.perf_counter() - began)),
            tolerance=effort.tolerance,
            polish=True,
        )
        again = solver.solve(tighter, inside, short, report)
        outcome = Outcome(
            again.x,
            "time limit" if again.status == "time limit" else outcome.status,
            outcome.iterations + again.iterations,
            outcome.evaluations + again.evaluations,
        )
        task = tighter
    raise NoAdmissibleMotionError(
        "The motion could not be kept admissible between the instants of sampling.constraints. "
        "Take a smaller sampling.constraints.step."
    )


def _drawn_inside(task: MotionTask, x: Array, start: Start) -> Array:
    """The point nearest to x on the way to the base motion whose residuals are all positive."""
    for share in np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 60)]):
        candidate = x + share * (start.base - x)
        if all(value.min() > 0 for value in task.values(task.states(candidate))):
            return candidate
    raise NoAdmissibleMotionError(
        "Nothing about the start has room any more once the motion is kept clear between instants. "
        "Take a smaller sampling.constraints.step."
    )


def _labelled(report: ProgressCallback, restart: int, restarts: int) -> ProgressCallback:
    if restarts == 1:
        return report

    def labelled(progress: Progress) -> None:
        report(replace(progress, stage=f"start {restart + 1}/{restarts}, {progress.stage}"))

    return labelled
