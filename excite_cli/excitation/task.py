"""One motion to be found, as a nonlinear program in free variables.

x (n·K',) holds, joint after joint, the coordinates of the coefficients in the free directions N of
the problem's boundary: α = α_0 + N Xᵀ with X = x as (n, K'). Equalities (start and end at rest, and
where) are gone with α_0 and N; without given postures α_0 is zero.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.criteria.base import Criterion
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.objective import Evaluation, Spectrum
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Progress, Stage
from excite_cli.excitation.residuals import Residuals
from excite_cli.excitation.stack import Stack

# First guess of what happens between the instants of the grid, as a share of a constraint's scale.
_FIRST_GUARD = 0.01


class MotionTask:
    """Cost and residuals of one motion on top of a stack."""

    def __init__(
        self, problem: Problem, stack: Stack | None = None, guards: list[Array] | None = None
    ) -> None:
        self.problem = problem
        self.stack = stack or Stack.empty(problem.columns)
        self.objective = problem.objective(self.stack)
        self.free = problem.boundary.free
        self.offset = problem.boundary.offset
        self.guards = _within_ends(problem, guards or first_guards(problem))
        self.residuals = Residuals(
            problem.constraints, problem.constraint_basis, self.free, self.guards
        )
        self.n = problem.robot.n
        self.k = self.free.shape[1]
        self.evaluations = 0

    def with_guards(self, guards: list[Array]) -> "MotionTask":
        """The same task with other guards."""
        return MotionTask(self.problem, self.stack, guards)

    @property
    def size(self) -> int:
        """Number of free variables."""
        return self.n * self.k

    def coefficients(self, x: Array) -> Array:
        """α (K, n) of the free variables."""
        return self.offset + self.change(x)

    def change(self, direction: Array) -> Array:
        """By how much α (K, n) changes when the free variables change by `direction`."""
        return self.free @ direction.reshape(self.n, self.k).T

    def variables(self, coefficients: Array) -> Array:
        """Free variables of the nearest α of the task."""
        return self.flat(np.linalg.pinv(self.free) @ (coefficients - self.offset))

    def flat(self, reduced: Array) -> Array:
        """(K', n) as the ordering of x."""
        return reduced.T.ravel()

    def evaluation(self, x: Array, criterion: Criterion) -> Evaluation:
        """Criterion, spectrum of the stack, and on demand the gradient (size,)."""
        self.evaluations += 1
        found = self.objective.evaluation(self.coefficients(x), criterion)
        return replace(found, gradient=lambda: self.flat(self.free.T @ found.gradient()))

    def states(self, x: Array) -> States:
        """Joint states on the constraint grid."""
        return self.problem.states(self.coefficients(x))

    def values(self, states: States) -> list[Array]:
        """Residuals (T, m) of every constraint; admissible where none is negative."""
        return self.residuals.values(states)

    def progress(
        self, iteration: int, spectrum: Spectrum, values: list[Array], seconds: float, stage: Stage
    ) -> Progress:
        """The record that is shown while a solver runs."""
        smallest = margin = float("inf")
        for constraint, value, guard in zip(
            self.problem.constraints, values, self.guards, strict=True
        ):
            at = int(np.argmin(value.min(axis=0)))
            if value[:, at].min() < smallest:
                smallest = float(value[:, at].min())
                margin = smallest * float(constraint.scale[at]) + float(guard[at])
        return Progress(iteration, spectrum.figure, margin, seconds, stage)

    @cached_property
    def metric(self) -> Array:
        """M (size, size): xᵀ M x is the mean square of q, v, a, jerk in units of their bounds.

        The natural length of a change of a motion. A thousandth of rad² (m²) is added for every
        joint, and of (rad/s²)² where acceleration is free, so that it is positive definite.
        """
        grid = self.residuals.grid
        metric = np.zeros((self.n, self.k, self.n, self.k))
        weights = np.zeros((4, self.n))
        for constraint in self.problem.constraints:
            columns = constraint.linear
            if columns is not None:
                inverse = np.zeros(self.n)
                inverse[columns.joints] = 1.0 / constraint.scale**2
                weights[columns.quantity] += inverse
        weights[0] += 1e-3
        weights[2, weights[2] == 0] += 1e-3
        for order in np.flatnonzero(weights.any(axis=1)).tolist():
            per_instant = np.tile(weights[order] / grid.samples, (grid.samples, 1))
            grid.add_joint_curvature(metric, order, per_instant)
        return metric.reshape(self.size, self.size)


def first_guards(problem: Problem) -> list[Array]:
    """Guards (m,) per constraint before anything is known about the motion.

    Linear margins on a Fourier series get the exact amount (Ehlich and Zeller); others an estimate.
    """
    factor = problem.trajectory.sampling_factor(
        len(problem.constraint_basis.times), float(np.diff(problem.constraint_basis.times[:2])[0])
    )
    guards = []
    for constraint in problem.constraints:
        if constraint.linear is not None and factor is not None:
            guards.append((1.0 - factor) * constraint.scale)
        else:
            guards.append(_FIRST_GUARD * constraint.scale)
    return guards


def _within_ends(problem: Problem, guards: list[Array]) -> list[Array]:
    """Guards (m,) that ask at most half of the margin that standing at a given end has.

    A given posture is never moved, and at rest nothing happens between instants.
    """
    ends = problem.boundary.postures
    if not len(ends):
        return guards
    still = States.still(problem.kinematics, ends)
    margins = [constraint.margins(still).min(axis=0) for constraint in problem.constraints]
    return [
        np.minimum(guard, 0.5 * np.maximum(margin, 0.0))
        for guard, margin in zip(guards, margins, strict=True)
    ]
