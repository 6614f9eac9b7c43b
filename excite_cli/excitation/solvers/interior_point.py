"""Feasible interior point with a structured Hessian.

Minimises f(x) + μ/T Σ b(c_i(x)) for falling μ, f being the smooth criterion with p rising at the
same time, and c_i > 0 the residuals. Every iterate is strictly admissible, so the run may be cut
off anywhere.

    b(c) = −log u + (u − 1) − (u − 1)²/2,  u = c/ĉ < 1,    b = 0 beyond ĉ

is a logarithmic barrier that ends at ĉ with two continuous derivatives: only near rows count, the
others need no derivative at all. The Hessian is B + μ/T Σ b''(c_i) ∇c_i ∇c_iᵀ: the barrier's part,
which changes fast, is exact but for the curvature of the constraints, and B is a damped BFGS
estimate for the criterion and that curvature, from differences of the gradient of
f + Σ λ_i c_i with the newer λ_i = μ/T b'(c_i). (With B for the criterion alone, motions got stuck
where a constraint bends along the way: Panda ended at 7.6, 16.6 and 20.9 from seeds that give 7.1,
7.9 and 7.6.) The barrier's sums over thousands of rows collapse because a row at
one instant is a Kronecker product of a basis row and a joint-space gradient (`residuals`), so an
iteration costs one Cholesky factor of the number of variables, and no quadratic program.
"""

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from excite_cli.constraints.base import Array, part_of
from excite_cli.constraints.joint_columns import JointColumns
from excite_cli.criteria.base import Criterion
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.objective import Evaluation, Spectrum
from excite_cli.excitation.progress import ProgressCallback, Stage, Status
from excite_cli.excitation.solvers.base import CutShortError, Effort, Solver
from excite_cli.excitation.task import (
    REACH,
    MotionTask,
    ResidualDerivatives,
    squared_per_instant,
    summed_per_instant,
)

# Damped BFGS: an update of the Hessian that stays positive definite (Powell 1978).


def damped_update(hessian: Array, step: Array, change: Array) -> Array:
    """BFGS kept positive definite by Powell's damping (Nocedal and Wright 2006, Eq. 18.15)."""
    image = hessian @ step
    curvature, bend = float(step @ change), float(step @ image)
    if bend <= 1e-14:
        return hessian
    if curvature < 0.1 * bend:
        share = 0.9 * bend / (bend - curvature)
        change = share * change + (1 - share) * image
        curvature = float(step @ change)
    return hessian - np.outer(image, image) / bend + np.outer(change, change) / curvature


# μ and the share of the criterion's continuation for each stage, and when a stage is done: the
# merit fell by less than this over the last `_WINDOW` iterations (never less than the tolerance).
# The last two stages took TALOS' arms from 5.68 to 5.20, where more of them found nothing.
_STAGES = ((1.0, 0, 5e-2), (0.3, 0, 2e-2), (0.1, 0, 1e-2), (0.03, 1, 5e-3), (0.01, 1, 2e-3),
           (0.003, 2, 1e-3), (0.001, 3, 5e-4), (0.0003, 4, 0.0))  # fmt: skip
_WINDOW = 8
_REACH_LINEAR, _REACH_OTHER = 0.5, REACH
_SUFFICIENT = 1e-4
_HALVINGS, _SHIFTS = 14, 20
_TO_BOUNDARY = 0.98


@dataclass(frozen=True)
class _Near:
    """Gradients of a constraint that is not linear, where its residuals (T, m) are `near`."""

    near: NDArray[np.bool_]
    rows: ResidualDerivatives


@dataclass(frozen=True, eq=False)
class _Point:
    """A strictly admissible point with all that was computed at it.

    The gradient (size,) of the criterion is computed where a step ends: most of the points that a
    search along a line tries are left at once.
    """

    x: Array
    states: States
    values: list[Array]
    found: Evaluation
    merit: float

    @property
    def spectrum(self) -> Spectrum:
        """Of all data with this motion."""
        return self.found.spectrum

    @cached_property
    def gradient(self) -> Array:
        """Of the criterion, (size,)."""
        return self.found.gradient()


class InteriorPoint(Solver):
    """Primal barrier with falling μ; see the module."""

    name = "interior_point"
    # Rank correlation of the figure with that at the end, over seeds: 0.07 to 0.98 after three
    # stages (Panda 0.98, UR10 0.07), 0.71 to 1.00 after four.
    told_apart = (3, 4)
    polish = 5

    def solve(
        self,
        task: MotionTask,
        x: Array,
        effort: Effort,
        report: ProgressCallback,
        memory: Array | None = None,
    ) -> Outcome:
        """Run the stages of `effort` from the strictly admissible `x`."""
        return _Run(task, effort, report, memory).stages(x)


class _Run:
    def __init__(
        self,
        task: MotionTask,
        effort: Effort,
        report: ProgressCallback,
        memory: Array | None = None,
    ) -> None:
        self.task, self.effort, self.report = task, effort, report
        self.began = time.perf_counter()
        self.iterations = 0
        self.best_x: Array | None = None
        self.best = float("inf")
        self.hessian = memory
        self.sized = memory is not None
        self.before: tuple[_Point, dict[int, _Near]] | None = None
        self.reach = [
            _REACH_OTHER if c.linear is None else _REACH_LINEAR for c in task.problem.constraints
        ]
        self.samples = task.residuals.grid.samples

    def stages(self, x: Array) -> Outcome:
        steps = self.task.problem.criterion.continuation()
        status = Status.CONVERGED
        way: list[Array] = []
        wanted = list(enumerate(_STAGES))[self.effort.first : self.effort.last]
        for number, (mu, step, change) in wanted:
            criterion = steps[min(step, len(steps) - 1)]
            change = max(change, self.effort.tolerance)
            stage = Stage(number + 1, len(_STAGES))
            try:
                x, status = self.stage(x, criterion, mu, change, stage)
            except KeyboardInterrupt:
                if self.best_x is None:
                    raise
                raise CutShortError(self.outcome(x, Status.INTERRUPTED, way)) from None
            way.append(x)
            if status.is_limit:
                break
        return self.outcome(x, status, way)

    def outcome(self, x: Array, status: Status, way: list[Array]) -> Outcome:
        assert self.best_x is not None
        return Outcome(
            self.best_x, status, self.iterations, self.task.evaluations, x, self.hessian, tuple(way)
        )

    def stage(
        self, x: Array, criterion: Criterion, mu: float, change: float, stage: Stage
    ) -> tuple[Array, Status]:
        point = self.point(x, criterion, mu)
        if point is None:
            raise NoAdmissibleMotionError(
                "The criterion is not finite at the start: the trajectory shows nothing of some "
                "parameters. Give it more coefficients or wider limits."
            )
        self.remember(point)
        self.before = None
        merits = [point.merit]
        while True:
            if self.iterations >= self.effort.max_iterations:
                return point.x, Status.ITERATION_LIMIT
            if time.perf_counter() - self.began > self.effort.max_seconds:
                return point.x, Status.TIME_LIMIT
            found = self.iterate(point, criterion, mu)
            if found is None:
                return point.x, Status.STALLED
            point = found
            self.iterations += 1
            self.remember(point)
            seconds = time.perf_counter() - self.began
            self.report(
                self.task.progress(self.iterations, point.spectrum, point.values, seconds, stage)
            )
            merits.append(point.merit)
            if len(merits) > _WINDOW and merits[-1 - _WINDOW] - merits[-1] < change:
                return point.x, Status.CONVERGED

    def remember(self, point: _Point) -> None:
        """Keep the best admissible point by the criterion requested, not its stand-in."""
        value = self.task.problem.criterion.value(point.spectrum.sigma)
        if value < self.best:
            self.best, self.best_x = value, point.x

    def point(self, x: Array, criterion: Criterion, mu: float) -> _Point | None:
        """Everything at x, or None where x is not strictly admissible."""
        states = self.task.states(x)
        values = self.task.values(states)
        if any(value.min() <= 0 for value in values):
            return None
        found = self.task.evaluation(x, criterion)
        if not np.isfinite(found.value):
            return None
        barrier = sum(
            float(_barrier(value[value < reach], reach).sum())
            for value, reach in zip(values, self.reach, strict=True)
        )
        merit = found.value + mu / self.samples * barrier
        return _Point(x, states, values, found, merit)

    def iterate(self, point: _Point, criterion: Criterion, mu: float) -> _Point | None:
        """One Newton step with a backtracking search that stays inside; None if it fails."""
        barrier_gradient, curvature, near = self.barrier_derivatives(point, mu)
        gradient = point.gradient + barrier_gradient
        if self.before is not None:
            self.learn(*self.before, point, near, mu)
        self.before = point, near
        if self.hessian is None:
            size = np.linalg.norm(point.gradient) + 1e-12
            self.hessian = self.task.metric * size
        direction = _descent(self.hessian + curvature, gradient)
        if direction is None:
            return None
        slope = float(gradient @ direction)
        step = self.longest_step(point, direction)
        for _ in range(_HALVINGS):
            found = self.point(point.x + step * direction, criterion, mu)
            if found is not None and found.merit <= point.merit + _SUFFICIENT * step * slope:
                return found
            step *= 0.5
        return None

    def longest_step(self, point: _Point, direction: Array) -> float:
        """Share of the step that keeps every linear bound, at most 1."""
        task, step = self.task, 1.0
        change = task.problem.constraint_basis.orders(task.change(direction))
        for constraint, value in zip(task.problem.constraints, point.values, strict=True):
            columns = constraint.linear
            if columns is None:
                continue
            rate = columns.signs * change[columns.quantity][:, columns.joints]
            rate /= constraint.scale
            closing = rate > 0
            if closing.any():
                step = min(step, _TO_BOUNDARY * float((value[closing] / rate[closing]).min()))
        return step

    def barrier_derivatives(
        self, point: _Point, mu: float
    ) -> tuple[Array, Array, dict[int, _Near]]:
        """Gradient (size,) and Gauss–Newton Hessian (size, size) of the barrier.

        Also the gradients of the constraints that are not linear, by their index.
        """
        task, grid = self.task, self.task.residuals.grid
        gradient = np.zeros((task.k, task.n))
        hessian = np.zeros((task.n, task.k, task.n, task.k))
        bends: dict[tuple[int, int], Array] = {}
        found: dict[int, _Near] = {}
        for index, constraint in enumerate(task.problem.constraints):
            value, reach = point.values[index], self.reach[index]
            weight = mu / self.samples
            columns = constraint.linear
            counted = value[value < reach] if columns is None else value
            first, second = weight * _first(counted, reach), weight * _second(counted, reach)
            if columns is not None:
                pull, bend = _per_joint(columns, constraint.scale, (first, second), task.n)
                grid.add_gradient(gradient, part_of(columns.quantity, pull))
                grid.add_joint_curvature(hessian, columns.quantity, bend)
                continue
            near = value < reach
            if not near.any():
                continue
            rows: ResidualDerivatives = task.residuals.rows(point.states, index, near)
            found[index] = _Near(near, rows)
            grid.add_gradient(gradient, summed_per_instant(rows, first, self.samples))
            for pair, squares in squared_per_instant(rows, second, self.samples).items():
                bends[pair] = bends[pair] + squares if pair in bends else squares
        grid.add_curvature(hessian, bends)
        return task.flat(gradient), hessian.reshape(task.size, task.size), found

    def learn(
        self,
        old: _Point,
        old_near: dict[int, _Near],
        new: _Point,
        new_near: dict[int, _Near],
        mu: float,
    ) -> None:
        """Update the Hessian's estimate by the step from `old` to `new`."""
        task, grid = self.task, self.task.residuals.grid
        bent = np.zeros((task.k, task.n))
        for index in old_near.keys() & new_near.keys():
            both = old_near[index].near & new_near[index].near
            pull = np.where(both, mu / self.samples, 0.0)
            pull[both] *= _first(new.values[index][both], self.reach[index])
            for sign, there in ((1.0, new_near[index]), (-1.0, old_near[index])):
                parts = summed_per_instant(there.rows, sign * pull[there.near], self.samples)
                grid.add_gradient(bent, parts)
        self.update(new.x - old.x, new.gradient - old.gradient + task.flat(bent))

    def update(self, step: Array, change: Array) -> None:
        """Powell-damped BFGS update of the estimate; the first also sets its size."""
        assert self.hessian is not None
        if not self.sized:
            self.sized = True
            size = float(step @ change) / float(step @ self.task.metric @ step)
            if size > 0:
                self.hessian = self.task.metric * size
        self.hessian = damped_update(self.hessian, step, change)


def _descent(hessian: Array, gradient: Array) -> Array | None:
    """−H⁻¹ g, with the diagonal raised until H is positive definite; None if nothing helps."""
    if not (np.isfinite(hessian).all() and np.isfinite(gradient).all()):
        return None
    diagonal = np.diag_indices_from(hessian)
    shift = max(1e-9 * float(np.abs(np.diag(hessian)).mean()), 1e-300)
    for _ in range(_SHIFTS):
        hessian[diagonal] += shift
        try:
            return np.asarray(-cho_solve(cho_factor(hessian, check_finite=False), gradient))
        except LinAlgError:
            shift *= 100.0
    return None


def _per_joint(
    columns: JointColumns, scale: Array, weights: tuple[Array, Array], joints: int
) -> tuple[Array, Array]:
    """Weights (T, n) per joint of gradient and curvature, of those (T, m) of linear margins."""
    select = np.zeros((len(columns.joints), joints))
    select[np.arange(len(columns.joints)), columns.joints] = 1.0
    first, second = weights
    return -(first * (columns.signs / scale)) @ select, (second / scale**2) @ select


def _barrier(value: Array, reach: float) -> Array:
    u = np.minimum(value / reach, 1.0)
    return -np.log(u) + (u - 1.0) - 0.5 * (u - 1.0) ** 2


def _first(value: Array, reach: float) -> Array:
    u = np.minimum(value / reach, 1.0)
    return -((1.0 - u) ** 2) / (u * reach)


def _second(value: Array, reach: float) -> Array:
    u = np.minimum(value / reach, 1.0)
    return (1.0 / u**2 - 1.0) / reach**2
