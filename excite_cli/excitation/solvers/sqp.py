"""Sequential quadratic programming with working sets.

At x the step d solves

    minimise ½ dᵀHd + gᵀd   subject to   c + J d ≥ ε

with g the gradient of the (smooth) criterion, c the residuals and H a Powell-damped BFGS estimate
of the Hessian of the Lagrangian. Of the thousands of rows only few are handed to the quadratic
program: dips (smallest in time) of residuals that are near zero, rows that bound the last step,
and then, until there are none, dips that the step itself would break. J d on the whole grid costs
one matrix product per derivative order, so this search is cheap and its result is that of the
full program. Where the rows contradict one another, those already broken are asked to mend only
in part (down to not getting worse, which d = 0 does).

The merit function is f + ν max(0, −min c), exact for ν ≥ Σλ (Han 1977); unlike the sum of all
violations it does not depend on how fine the grid is. A full step refused for the curvature of
the constraints is tried once more with their second-order error taken off (Fletcher 1982).

Iterates may leave the admissible set; the best admissible point is kept aside (`BestAdmissible`).
"""

import time
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from excite_cli.constraints.base import Array
from excite_cli.constraints.joint_bound import JointBound
from excite_cli.criteria.base import Criterion
from excite_cli.dynamics.states import States
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.objective import Spectrum
from excite_cli.excitation.progress import ProgressCallback, Stage, Status
from excite_cli.excitation.residuals import summed_per_instant
from excite_cli.excitation.solvers.base import Effort, Solver
from excite_cli.excitation.solvers.linearised import Linearised, Mask, dips, gathered, lowest
from excite_cli.excitation.solvers.quadratic_program import (
    QuadraticBackend,
    QuadraticSolution,
    build_backend,
)
from excite_cli.excitation.solvers.quasi_newton import damped_update
from excite_cli.excitation.solvers.restoration import BestAdmissible
from excite_cli.excitation.task import MotionTask

# What a stage may still gain over `_WINDOW` iterations when it counts as done, first to last.
_CHANGES = (3e-2, 1e-2, 1e-3)
_WINDOW = 8
# ε, and the residuals below which a dip enters the first working set or is linearised at all.
_AIM, _NEAR, _REACH = 1e-4, 0.05, 1.0
_MENDED_SHARES = (1.0, 0.3, 0.0)
_CUTS = 8
_SUFFICIENT, _HALVINGS = 1e-4, 10
_RESTORATIONS = 10


@dataclass(frozen=True)
class _Point:
    """A point, admissible or not, with all that was computed at it."""

    x: Array
    states: States
    values: list[Array]
    cost: float
    gradient: Array
    spectrum: Spectrum

    @property
    def violation(self) -> float:
        return max(0.0, -lowest(self.values))


@dataclass(frozen=True)
class _Step:
    """A step, the rows that were in its program, their multipliers, and the violation left."""

    direction: Array
    chosen: list[Mask]
    multipliers: Array
    predicted: float


class SequentialQuadratic(Solver):
    """Damped-BFGS SQP on working sets; see the module."""

    name = "sqp"

    def __init__(self, backend: str = "piqp") -> None:
        self.backend = build_backend(backend)

    def solve(
        self, task: MotionTask, x: Array, effort: Effort, report: ProgressCallback
    ) -> Outcome:
        """Minimise one continuation step after the other from the admissible `x`."""
        return _Run(task, effort, report, self.backend).all_stages(x)


class _Run:
    def __init__(
        self, task: MotionTask, effort: Effort, report: ProgressCallback, backend: QuadraticBackend
    ) -> None:
        self.task, self.effort, self.report, self.backend = task, effort, report, backend
        self.began = time.perf_counter()
        self.iterations = 0
        self.best = BestAdmissible(task)
        self.hessian: Array | None = None
        self.penalty = 0.0
        self.active: list[Mask] | None = None

    def all_stages(self, x: Array) -> Outcome:
        steps = self.task.problem.criterion.continuation()
        steps = steps[-1:] if self.effort.polish else steps
        status = Status.CONVERGED
        for number, criterion in enumerate(steps):
            change = _CHANGES[max(number - len(steps), -len(_CHANGES))]
            change = max(change, self.effort.tolerance)
            x, status = self.stage(x, criterion, change, Stage(number + 1, len(steps)))
            if status.is_limit:
                break
        self.best.offer_restored(x)
        return Outcome(self.best.kept(), status, self.iterations, self.task.evaluations)

    def stage(
        self, x: Array, criterion: Criterion, change: float, stage: Stage
    ) -> tuple[Array, Status]:
        point = self.point(x, criterion)
        history = [(point.cost, point.violation)]
        while True:
            if self.iterations >= self.effort.max_iterations:
                return point.x, Status.ITERATION_LIMIT
            if time.perf_counter() - self.began > self.effort.max_seconds:
                return point.x, Status.TIME_LIMIT
            found = self.iterate(point, criterion)
            if found is None:
                return point.x, Status.STALLED
            point = found
            self.iterations += 1
            seconds = time.perf_counter() - self.began
            self.report(
                self.task.progress(self.iterations, point.spectrum, point.values, seconds, stage)
            )
            history.append((point.cost, point.violation))
            merits = [cost + self.penalty * violation for cost, violation in history]
            if len(merits) > _WINDOW and merits[-1 - _WINDOW] - merits[-1] < change:
                return point.x, Status.CONVERGED

    def point(self, x: Array, criterion: Criterion) -> _Point:
        states = self.task.states(x)
        values = self.task.values(states)
        cost, gradient, spectrum = self.task.cost(x, criterion)
        self.best.offer(x, values, spectrum)
        return _Point(x, states, values, cost, gradient, spectrum)

    def iterate(self, point: _Point, criterion: Criterion) -> _Point | None:
        """One step with its line search; a failure is tried again with a fresh Hessian."""
        linear = Linearised(self.task, point.states, point.values)
        for fresh in (self.hessian is None, True):
            if fresh:
                size = np.linalg.norm(point.gradient) + 1e-12
                self.hessian = self.task.metric * size
            step = self.step(point, linear, point.values)
            if step is None:
                continue
            found = self.search(point, linear, step, criterion)
            if found is not None:
                self.update(point, found, linear, step, fresh)
                self.active = _active(step)
                return found
        return None

    def step(self, point: _Point, linear: Linearised, values: list[Array]) -> _Step | None:
        """The step that the quadratic program gives when the residuals at x are `values`."""
        chosen = [
            (value < _NEAR) & dips(value) & near
            for value, near in zip(values, linear.near, strict=True)
        ]
        if self.active is not None:
            chosen = [
                mask | (last & near)
                for mask, last, near in zip(chosen, self.active, linear.near, strict=True)
            ]
        for share in _MENDED_SHARES:
            wanted = [
                np.where(value >= _AIM, _AIM, value + share * (_AIM - value)) for value in values
            ]
            step = self.cut(point, linear, values, wanted, chosen)
            if step is not None:
                return step
        return None

    def cut(
        self,
        point: _Point,
        linear: Linearised,
        values: list[Array],
        wanted: list[Array],
        chosen: list[Mask],
    ) -> _Step | None:
        """Solve, add the dips that the step breaks, and solve again until there are none."""
        for _ in range(_CUTS):
            bounds = gathered(wanted, chosen) - gathered(values, chosen)
            solution = self.solved(point, linear.dense(chosen), bounds)
            if solution is None:
                return None
            changes = linear.change(solution.x)
            reached = [value + change for value, change in zip(values, changes, strict=True)]
            step = _Step(solution.x, chosen, solution.multipliers, max(0.0, -lowest(reached)))
            broken = [
                (have < want - 0.5 * _AIM) & dips(have - want) & near & ~mask
                for have, want, near, mask in zip(reached, wanted, linear.near, chosen, strict=True)
            ]
            if not any(mask.any() for mask in broken):
                break
            chosen = [mask | new for mask, new in zip(chosen, broken, strict=True)]
        return step

    def solved(self, point: _Point, rows: Array, bounds: Array) -> QuadraticSolution | None:
        assert self.hessian is not None
        shift = 1e-9 * np.trace(self.hessian) / len(self.hessian)
        hessian = self.hessian + shift * np.eye(len(self.hessian))
        if len(bounds):
            return self.backend.minimise(hessian, point.gradient, rows, bounds)
        newton = -cho_solve(cho_factor(hessian), point.gradient)
        return QuadraticSolution(newton, np.zeros(0))

    def search(
        self, point: _Point, linear: Linearised, step: _Step, criterion: Criterion
    ) -> _Point | None:
        """Backtrack on the merit function, with one second-order correction of the full step."""
        self.penalty = max(self.penalty, 1.2 * float(step.multipliers.sum()) + 1e-3)
        merit = point.cost + self.penalty * point.violation
        mended = point.violation - step.predicted
        slope = float(point.gradient @ step.direction) - self.penalty * mended
        if slope >= 0:
            return None
        share, direction = 1.0, step.direction
        for trial in range(_HALVINGS):
            found = self.point(point.x + share * direction, criterion)
            reached = found.cost + self.penalty * found.violation
            if reached <= merit + _SUFFICIENT * share * slope:
                return found
            if trial == 0 and found.violation > step.predicted + _AIM:
                corrected = self.corrected(point, linear, step, found)
                if corrected is not None:
                    found = self.point(point.x + corrected, criterion)
                    reached = found.cost + self.penalty * found.violation
                    if reached <= merit + _SUFFICIENT * slope:
                        return found
            share *= 0.5
            if time.perf_counter() - self.began > self.effort.max_seconds:
                break
        return None

    def corrected(
        self, point: _Point, linear: Linearised, step: _Step, reached: _Point
    ) -> Array | None:
        """The step for residuals whose second-order error at the full step is known."""
        changes = linear.change(step.direction)
        values = [
            np.where(near, there - change, here)
            for there, change, here, near in zip(
                reached.values, changes, point.values, linear.near, strict=True
            )
        ]
        found = self.step(point, linear, values)
        return None if found is None else found.direction

    def update(
        self, point: _Point, found: _Point, linear: Linearised, step: _Step, fresh: bool
    ) -> None:
        """Damped BFGS with the change of the Lagrangian's gradient between two points."""
        assert self.hessian is not None
        moved = found.x - point.x
        change = found.gradient - point.gradient
        change = change - self.pulled(found, step) + self.pulled(point, step)
        length = float(moved @ self.task.metric @ moved)
        if fresh and float(moved @ change) > 0 and length > 0:
            self.hessian = self.task.metric * (float(moved @ change) / length)
        self.hessian = damped_update(self.hessian, moved, change)

    def pulled(self, point: _Point, step: _Step) -> Array:
        """Jᵀλ of the curved constraints at a point; that of joint bounds never changes."""
        gradient = np.zeros((self.task.k, self.task.n))
        grid, start = self.task.residuals.grid, 0
        for index, constraint in enumerate(self.task.problem.constraints):
            mask = step.chosen[index].copy()
            weights = step.multipliers[start : start + np.count_nonzero(mask)]
            start += len(weights)
            if isinstance(constraint, JointBound) or not weights.any():
                continue
            mask[mask] = weights > 0
            rows = self.task.residuals.rows(point.states, index, mask)
            grid.add_gradient(
                gradient, summed_per_instant(rows, weights[weights > 0], grid.samples)
            )
        return self.task.flat(gradient)


def _active(step: _Step) -> list[Mask]:
    """The chosen rows with a multiplier that counts."""
    least = 1e-6 * float(step.multipliers.max(initial=0.0))
    found, start = [], 0
    for chosen in step.chosen:
        mask = chosen.copy()
        count = int(np.count_nonzero(mask))
        mask[mask] = step.multipliers[start : start + count] > least
        start += count
        found.append(mask)
    return found
