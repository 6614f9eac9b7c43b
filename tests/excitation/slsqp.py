"""SciPy's SLSQP on working sets: the reference that the solver of the product is compared with.

SLSQP solves a dense least-squares problem with every row it is given, so it is run in short
rounds, each within a box, on few rows: the dips (smallest in time) of residuals near zero. After
a round the rows that its result breaks, or has come near to, are added; none is dropped before
the next criterion of the continuation. Every point that SLSQP visits and that is admissible on
the whole grid is a candidate for the outcome, and so is the result of every round once it is
restored.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from excite_cli.constraints.base import Array
from excite_cli.criteria.base import Criterion
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.base_motion import (
    Mask,
    chosen_rows,
    corrected,
    dips,
    gathered,
    lowest,
)
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.objective import Spectrum
from excite_cli.excitation.progress import ProgressCallback, Stage, Status
from excite_cli.excitation.solvers.base import Effort, Solver
from excite_cli.excitation.task import MotionTask

# Residuals kept by the program, and below which a dip joins the working set.
_AIM, _NEAR = 1e-4, 0.1
# Iterations of a round: few at first, when it is not known yet what will bind; and what a stage
# may still gain in a round (on the criterion asked for) when it counts as done.
_FIRST_ROUND, _LONGEST_ROUND, _IDLE = 2, 12, 3
# How far a round may move each variable: it grows with success. A round whose result breaks a
# residual by more than `_LOST` and cannot be restored is undone and the box made smaller.
_FIRST_RADIUS, _NARROWEST, _WIDEST, _LOST = 0.1, 1e-3, 10.0, 0.05
_CHANGES = (3e-2, 1e-2, 1e-3)


class BestAdmissible:
    """The best strictly admissible point seen, by the criterion asked for."""

    def __init__(self, task: MotionTask) -> None:
        self.task = task
        self.x: Array | None = None
        self.cost = np.inf

    def offer(self, x: Array, values: list[Array], spectrum: Spectrum) -> None:
        """Keep x if it is strictly admissible and better than what is kept."""
        cost = self.task.problem.criterion.value(spectrum.sigma)
        if lowest(values) > 0 and (cost < self.cost or self.x is None):
            self.x, self.cost = x.copy(), cost

    def kept(self) -> Array:
        """The point itself; there is one as soon as an admissible start was offered."""
        assert self.x is not None, "a solver starts from an admissible point"
        return self.x

    def offer_restored(self, x: Array) -> None:
        """Offer the admissible point that least-length corrections or a retreat make of x."""
        candidate = corrected(self.task, x)
        if candidate is None:
            candidate = self._retreated(x)
        self.task.evaluations += 1
        objective = self.task.objective
        block = objective.block(self.task.coefficients(candidate))
        values = self.task.values(self.task.states(candidate))
        self.offer(candidate, values, objective.spectrum(block))

    def _retreated(self, x: Array) -> Array:
        """A point on the way from the kept point to x, as far along as bisection proves."""
        inside, outside = 0.0, 1.0
        start = self.kept()
        for _ in range(12):
            middle = 0.5 * (inside + outside)
            values = self.task.values(self.task.states(start + middle * (x - start)))
            if lowest(values) > 0:
                inside = middle
            else:
                outside = middle
        return start + inside * (x - start)


class _Stopped(Exception):
    """Raised out of SciPy's loop when an effort is used up."""

    def __init__(self, status: Status) -> None:
        super().__init__(status)
        self.status = status


class ScipySlsqp(Solver):
    """SLSQP in short rounds with growing working sets; see the module."""

    name = "slsqp"

    def solve(
        self,
        task: MotionTask,
        x: Array,
        effort: Effort,
        report: ProgressCallback,
        memory: Array | None = None,
    ) -> Outcome:
        """Minimise one continuation step after the other from the admissible `x`."""
        return _Run(task, effort, report).all_stages(x)


@dataclass(frozen=True)
class _Point:
    x: Array
    states: States
    values: list[Array]
    cost: float
    gradient: Array
    spectrum: Spectrum


class _Run:
    def __init__(self, task: MotionTask, effort: Effort, report: ProgressCallback) -> None:
        self.task, self.effort, self.report = task, effort, report
        self.began = time.perf_counter()
        self.iterations = 0
        self.best = BestAdmissible(task)
        self.last: _Point | None = None
        self.criterion: Criterion = task.problem.criterion
        self.stage = Stage()
        self.reached = np.zeros(0)
        self.length = _FIRST_ROUND
        self.radius = _FIRST_RADIUS
        # SLSQP's first Hessian is the identity: variables are scaled to make that a good guess.
        self.factor = np.linalg.cholesky(
            task.metric + 1e-9 * np.trace(task.metric) / task.size * np.eye(task.size)
        )
        self.inverse = np.linalg.inv(self.factor).T

    def all_stages(self, x: Array) -> Outcome:
        steps = self.task.problem.criterion.continuation()
        steps = steps[-1:] if self.effort.first else steps
        status = Status.CONVERGED
        self.reached = x
        try:
            for number, criterion in enumerate(steps):
                self.criterion, self.last = criterion, None
                self.stage = Stage(number + 1, len(steps))
                change = _CHANGES[max(number - len(steps), -len(_CHANGES))]
                self.rounds(max(change, self.effort.tolerance))
        except _Stopped as stopped:
            status = stopped.status
        self.best.offer_restored(self.reached)
        return Outcome(self.best.kept(), status, self.iterations, self.task.evaluations)

    def rounds(self, change: float) -> None:
        """Rounds of one criterion until `_IDLE` in a row hardly improve the best point."""
        idle = 0
        chosen = [np.zeros_like(value, dtype=bool) for value in self.point(self.reached).values]
        while True:
            chosen = self.joined(chosen)
            before = self.best.cost
            self.round(chosen)
            self.length = min(self.length + 1, _LONGEST_ROUND)
            self.best.offer_restored(self.reached)
            if before - self.best.cost >= change:
                idle, self.radius = 0, min(2.0 * self.radius, _WIDEST)
                continue
            if lowest(self.point(self.reached).values) < -_LOST and self.radius > _NARROWEST:
                self.reached, self.radius = self.best.kept(), 0.3 * self.radius
                continue
            idle += 1
            if idle == _IDLE:
                return

    def joined(self, chosen: list[Mask]) -> list[Mask]:
        """The working set with the dips of the point reached."""
        values = self.point(self.reached).values
        return [
            mask | ((value < _NEAR) & dips(value))
            for mask, value in zip(chosen, values, strict=True)
        ]

    def round(self, chosen: list[Mask]) -> None:
        """A few iterations of SLSQP on the chosen rows, in y with x = L⁻ᵀ y."""

        def residuals(y: Array) -> Array:
            return gathered(self.point(self.inverse @ y).values, chosen) - _AIM

        def jacobian(y: Array) -> Array:
            point = self.point(self.inverse @ y)
            rows = chosen_rows(self.task, point.states, chosen)
            return np.asarray(rows @ self.inverse)

        def cost(y: Array) -> tuple[float, Array]:
            point = self.point(self.inverse @ y)
            return point.cost, self.inverse.T @ point.gradient

        constraints: list[Any] = []
        if any(mask.any() for mask in chosen):
            constraints = [{"type": "ineq", "fun": residuals, "jac": jacobian}]
        y0 = self.factor.T @ self.reached
        result = minimize(
            cost,
            y0,
            bounds=np.column_stack([y0 - self.radius, y0 + self.radius]),
            jac=True,
            method="SLSQP",
            constraints=constraints,
            callback=self.iterated,
            options={"maxiter": self.length, "ftol": 0.1 * self.effort.tolerance},
        )
        x = self.inverse @ np.asarray(result.x)
        if np.all(np.isfinite(x)):
            self.reached = x

    def iterated(self, y: Array) -> None:
        """Count, report, and stop when the effort is used up."""
        self.reached = self.inverse @ y
        point = self.point(self.reached)
        self.iterations += 1
        seconds = time.perf_counter() - self.began
        self.report(
            self.task.progress(self.iterations, point.spectrum, point.values, seconds, self.stage)
        )
        if self.iterations >= self.effort.max_iterations:
            raise _Stopped(Status.ITERATION_LIMIT)

    def point(self, x: Array) -> _Point:
        """All about x; the last point is kept, as SciPy asks for its parts one by one."""
        if self.last is not None and np.array_equal(self.last.x, x):
            return self.last
        if time.perf_counter() - self.began > self.effort.max_seconds:
            raise _Stopped(Status.TIME_LIMIT)
        states = self.task.states(x)
        values = self.task.values(states)
        found = self.task.evaluation(x, self.criterion)
        cost, gradient, spectrum = found.value, found.gradient(), found.spectrum
        self.best.offer(x, values, spectrum)
        self.last = _Point(x.copy(), states, values, cost, gradient, spectrum)
        return self.last
