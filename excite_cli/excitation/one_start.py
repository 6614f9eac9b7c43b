"""One start of a motion: drawn, solved, and corrected until it holds between the instants too.

It depends on its arguments only, and these can be pickled: it may be done by any worker.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.admissible import lacking_margins
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Figure, ProgressCallback, Status
from excite_cli.excitation.solvers.base import CutShortError, Effort, Solver
from excite_cli.excitation.start import Start, random_start
from excite_cli.excitation.task import MotionTask

_GUARD_ROUNDS = 6
_GUARD_GROWTH = 1.3
# Times as much where the last rise changed next to nothing: a proof that only looked at too many
# intervals tells a trifle (1e-5), and six rises by it left a TALOS on its feet without a motion.
_GUARD_FASTER = 4.0


@dataclass(frozen=True)
class StartContext:
    """What all starts share."""

    problem: Problem
    solver: Solver


@dataclass(frozen=True)
class FoundMotion:
    """What a start led to: the criterion of that, what is reported of it, how long it took [s].

    After `stages` of the solver; None: it has ended.
    """

    value: float
    figure: Figure
    outcome: Outcome
    seconds: float
    stages: int | None = None


@dataclass(frozen=True)
class OneStart:
    """What to begin with: earlier data, the motion to draw about, (seed, index, number).

    With `first` (size,) nothing is drawn: the search begins there, with the stage `begin`. With
    `found` it goes on from there. It is done up to the stage `until` (excluded; None: to the end).
    """

    stack: Stack
    start: Start
    seed: tuple[int, int, int]
    first: Array | None = None
    begin: int = 0
    found: FoundMotion | None = None
    until: int | None = None


class StoppedError(KeyboardInterrupt):
    """Ctrl-C while a start is done; `found` is what it had led to, not corrected yet."""

    def __init__(self, found: FoundMotion) -> None:
        super().__init__()
        self.found = found


def solve_start(
    search: StartContext, task: OneStart, report: ProgressCallback
) -> FoundMotion | NoAdmissibleMotionError:
    """What the start leads to; an error is returned, since one failure does not end the others."""
    problem, solver = search.problem, search.solver
    began = time.perf_counter()
    run = MotionTask(problem, task.stack)
    try:
        try:
            outcome = _solved(run, solver, task, report)
        except CutShortError as stop:
            raise StoppedError(_found(run, task, stop.outcome, began, stages=0)) from None
        ended = task.until is None or outcome.status.is_limit
        if ended:
            effort = _effort(problem, task, 0)
            outcome = kept_between_instants(run, solver, task.start, outcome, effort, report)
            outcome = replace(outcome, last=None, memory=None, way=())
    except NoAdmissibleMotionError as error:
        return NoAdmissibleMotionError(str(error))
    return _found(run, task, outcome, began, None if ended else task.until)


def interrupted(search: StartContext, task: OneStart, found: FoundMotion) -> FoundMotion:
    """What a start has led to when the search is interrupted, corrected as at its end.

    Raises
    ------
    NoAdmissibleMotionError
        It cannot be kept admissible between the instants.
    """
    began, run = time.perf_counter(), MotionTask(search.problem, task.stack)
    outcome = found.outcome
    if found.stages is not None:
        effort = _effort(search.problem, task, 0)
        outcome = kept_between_instants(
            run, search.solver, task.start, outcome, effort, lambda told: None
        )
    outcome = replace(outcome, status=Status.INTERRUPTED, last=None, memory=None, way=())
    return _found(run, replace(task, found=found), outcome, began, None)


def _found(
    run: MotionTask, task: OneStart, outcome: Outcome, began: float, stages: int | None
) -> FoundMotion:
    spectrum = run.objective.spectrum(run.objective.block(run.coefficients(outcome.x)))
    value = run.problem.criterion.value(spectrum.sigma)
    seconds = time.perf_counter() - began + (task.found.seconds if task.found else 0.0)
    return FoundMotion(value, spectrum.figure, outcome, seconds, stages)


def _solved(run: MotionTask, solver: Solver, task: OneStart, report: ProgressCallback) -> Outcome:
    """The outcome after the stages that are asked for, with the iterations of all before."""
    found = task.found
    if found is None:
        x = task.first if task.first is not None else random_start(run, task.start, task.seed)
        return solver.solve(run, x, _effort(run.problem, task, task.begin), report)
    before = found.outcome
    assert before.last is not None
    effort = _effort(run.problem, task, found.stages or 0)
    outcome = solver.solve(run, before.last, effort, _after(before, report), before.memory)
    value = run.objective.value(run.coefficients(outcome.x), run.problem.criterion)
    return replace(
        outcome,
        x=outcome.x if value <= found.value else before.x,
        iterations=before.iterations + outcome.iterations,
        evaluations=before.evaluations + outcome.evaluations,
        way=(*before.way, *outcome.way),
    )


def _effort(problem: Problem, task: OneStart, first: int) -> Effort:
    """What is left of the effort that the config allows a start."""
    spec = problem.spec.optimizer
    iterations, seconds = spec.max_iterations, spec.max_seconds
    if task.found is not None:
        iterations -= task.found.outcome.iterations
        seconds -= task.found.seconds
    return Effort(max(iterations, 0), max(seconds, 0.0), problem.tolerance, first, task.until)


def _after(before: Outcome, report: ProgressCallback) -> ProgressCallback:
    return lambda told: report(replace(told, iteration=told.iteration + before.iterations))


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
    is raised by it, and the solver goes on from the nearest point that has the new guards, on the
    way back that it came by, or else to the base motion.
    """
    problem = task.problem
    began = time.perf_counter()
    before = [np.zeros_like(guard) for guard in task.guards]
    growths = [np.full_like(guard, _GUARD_GROWTH) for guard in task.guards]
    for round_ in range(_GUARD_ROUNDS + 1):
        lacking = lacking_margins(problem, task.coefficients(outcome.x))
        if not any(lack.any() for lack in lacking):
            return outcome
        if round_ == _GUARD_ROUNDS:
            break
        growths = [
            np.where((last > 0.0) & (2.0 * lack > last), _GUARD_FASTER * growth, growth)
            for growth, lack, last in zip(growths, lacking, before, strict=True)
        ]
        before = lacking
        guards = [
            guard + growth * lack
            for guard, growth, lack in zip(task.guards, growths, lacking, strict=True)
        ]
        tighter = MotionTask(task.problem, task.stack, guards)
        inside = _drawn_inside(tighter, outcome, start)
        short = Effort(
            max_iterations=max(10, effort.max_iterations // 8),
            max_seconds=max(1.0, effort.max_seconds / 4 - (time.perf_counter() - began)),
            tolerance=effort.tolerance,
            first=solver.polish,
        )
        again = solver.solve(tighter, inside, short, report)
        outcome = Outcome(
            again.x,
            again.status if again.status is Status.TIME_LIMIT else outcome.status,
            outcome.iterations + again.iterations,
            outcome.evaluations + again.evaluations,
            way=outcome.way,
        )
        task = tighter
    raise NoAdmissibleMotionError(
        "The motion could not be kept admissible between the instants of sampling.constraints. "
        "Take a smaller sampling.constraints.step."
    )


def _drawn_inside(task: MotionTask, outcome: Outcome, start: Start) -> Array:
    """A point near the outcome whose residuals are all positive.

    Points that the solver came by are near and have more room; the straight way to standing still
    may lead through limits nearly to its end, and what is found there shows nothing (two of four
    seeds of a humanoid on its feet).
    """
    x = outcome.x
    for anchor in (*reversed(outcome.way), start.base):
        for share in np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 30)]):
            candidate = x + share * (anchor - x)
            if all(value.min() > 0 for value in task.values(task.states(candidate))):
                return np.asarray(candidate)
    raise NoAdmissibleMotionError(
        "Nothing about the start has room any more once the motion is kept clear between instants. "
        "Take a smaller sampling.constraints.step."
    )
