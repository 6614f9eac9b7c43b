"""One start of a motion: drawn, solved, and corrected until it holds between the instants too.

It depends on its arguments only, and these can be pickled: it may be done by any worker.
"""

import time
from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.admissible import lacking_margins
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Figure, ProgressCallback, Status
from excite_cli.excitation.solvers.base import Effort, Solver
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import Start, random_start
from excite_cli.excitation.task import MotionTask

_GUARD_ROUNDS = 6
_GUARD_GROWTH = 1.3


@dataclass(frozen=True)
class Search:
    """What all starts share."""

    problem: Problem
    solver: Solver


@dataclass(frozen=True)
class OneStart:
    """What to begin with: earlier data, the motion to draw about, (seed, index, number).

    With `first` (size,) nothing is drawn, the search begins there.
    """

    stack: Stack
    start: Start
    seed: tuple[int, int, int]
    first: Array | None = None


@dataclass(frozen=True)
class FoundMotion:
    """What a start led to: the criterion of that, what is reported of it, how long it took [s]."""

    value: float
    figure: Figure
    outcome: Outcome
    seconds: float


def solve_start(
    search: Search, task: OneStart, report: ProgressCallback
) -> FoundMotion | NoAdmissibleMotionError:
    """What the start leads to; an error is returned, since one failure does not end the others."""
    problem, solver = search.problem, search.solver
    began = time.perf_counter()
    spec = problem.spec.optimizer
    effort = Effort(spec.max_iterations, spec.max_seconds, spec.tolerance)
    run = MotionTask(problem, task.stack)
    try:
        x = task.first if task.first is not None else random_start(run, task.start, task.seed)
        outcome = solver.solve(run, x, effort, report)
        outcome = kept_between_instants(run, solver, task.start, outcome, effort, report)
    except NoAdmissibleMotionError as error:
        return NoAdmissibleMotionError(str(error))
    spectrum = run.objective.spectrum(run.objective.block(run.coefficients(outcome.x)))
    value = problem.criterion.value(spectrum.sigma)
    return FoundMotion(value, spectrum.figure, outcome, time.perf_counter() - began)


def kept_between_instants(
    task: MotionTask,
    solver: Solver,
    start: Start,
    outcome: Outcome,
    effort: Effort,
    report: ProgressCallback,
) -> Outcome:
    """The outcome, corrected until every constraint is proved between the instants.

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
            again.status if again.status is Status.TIME_LIMIT else outcome.status,
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
