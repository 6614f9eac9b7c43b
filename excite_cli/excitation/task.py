"""One motion to be found, as a nonlinear program in free variables, and its residuals.

x (n·K',) holds, joint after joint, the coordinates of the coefficients in the free directions N of
the problem's boundary: α = α_0 + N Xᵀ with X = x as (n, K'). Equalities (start and end at rest, and
where) are gone with α_0 and N; without given postures α_0 is zero.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from excite_cli.arrays import Mask
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.criteria.base import Criterion
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.objective import Evaluation, Spectrum, Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Progress, Stage
from excite_cli.kernels.compiled import KERNELS
from excite_cli.trajectory.base import Basis

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


# Constraints as an optimiser wants them: dimensionless, guarded, and fast to differentiate.
#
# A residual is (margin − guard) / scale, admissible where not negative. The guard keeps what lies
# between the instants of the grid: exact for bounds on a Fourier series (its sampling factor), an
# estimate for the others, raised when a finer grid shows it to be too small.
#
# Derivatives with respect to q at one instant reach the coefficients through the same basis row,
# so weighted sums over thousands of rows collapse to one matrix product per pair of derivative
# orders: Σ_t (b_t b_tᵀ) ⊗ G_t.

# Residuals beyond this concern no solver: they may be lower bounds instead of exact.
REACH = 1.0


@dataclass(frozen=True)
class ResidualDerivatives:
    """Derivatives of K near residuals of one constraint, at `times` and `columns`."""

    times: Indices
    columns: Indices
    parts: Parts


class GridProducts:
    """Products of basis functions on the constraint grid, reduced to the free directions."""

    def __init__(self, basis: Basis, free: Array) -> None:
        self.orders = tuple(np.ascontiguousarray(order @ free) for order in basis.by_order)
        self.samples, self.size = self.orders[0].shape
        self._squares: dict[tuple[int, int], Array] = {}

    def squares(self, i: int, j: int) -> Array:
        """b_t b_t'ᵀ of a pair of orders i ≤ j: (T, K²), or the lower half of it where they agree.

        Only of pairs that are asked for: jerk stands beside no other order.
        """
        if (i, j) not in self._squares:
            if i == j:
                low, high = np.tril_indices(self.size)
                self._squares[i, j] = self.orders[i][:, low] * self.orders[i][:, high]
            else:
                both = self.orders[i][:, :, None] * self.orders[j][:, None, :]
                self._squares[i, j] = both.reshape(self.samples, -1)
        return self._squares[i, j]

    def add_gradient(self, gradient: Array, per_instant: Sequence[Array | None]) -> None:
        """Add Σ_t b_t g_tᵀ to `gradient` (K, n); `per_instant`: (T, n) per order, from q on."""
        for order, part in zip(self.orders, per_instant, strict=False):
            if part is not None:
                gradient += order.T @ part

    def add_joint_curvature(self, hessian: Array, order: int, weights: Array) -> None:
        """Add the blocks of separate joints: weights (T, n) on the squared basis."""
        blocks = (self.squares(order, order).T @ weights)[_unfolded(self.size)]
        joints = np.arange(weights.shape[1])
        hessian[joints, :, joints, :] += blocks.transpose(2, 0, 1)

    def add_curvature(self, hessian: Array, weights: Mapping[tuple[int, int], Array]) -> None:
        """Add Σ_t (b_t^i b_t^jᵀ) ⊗ G_t to `hessian` (n, K, n, K), of every pair of orders i ≤ j.

        weights: G (T, n, n) per pair. What stands beside the diagonal counts on both sides.
        """
        k, n = self.size, hessian.shape[0]
        low, high = np.tril_indices(n)
        even = [pair for pair in weights if pair[0] == pair[1]]
        mixed = [pair for pair in weights if pair[0] != pair[1]]
        if even:  # symmetric in the basis and in the joints: a quarter of the products
            blocks = sum(weights[pair][:, low, high].T @ self.squares(*pair) for pair in even)
            blocks = np.asarray(blocks)[_unfolded(n)][:, :, _unfolded(k)]
            hessian += blocks.transpose(0, 2, 1, 3)
        if mixed:
            flat = sum(
                weights[pair].reshape(self.samples, -1).T @ self.squares(*pair) for pair in mixed
            )
            blocks = np.ascontiguousarray(
                np.asarray(flat).reshape(n, n, k, k).transpose(0, 2, 1, 3)
            ).reshape(n * k, n * k)
            hessian += (blocks + blocks.T).reshape(n, k, n, k)


@cache
def _unfolded(size: int) -> Indices:
    """Where the entries of a symmetric matrix (size, size) are in the list of its lower half."""
    place = np.zeros((size, size), dtype=np.intp)
    low, high = np.tril_indices(size)
    place[low, high] = place[high, low] = np.arange(len(low))
    return place


class Residuals:
    """All constraints of a problem on its grid, with their guards."""

    def __init__(
        self, constraints: tuple[Constraint, ...], basis: Basis, free: Array, guards: list[Array]
    ) -> None:
        self.constraints, self.guards = constraints, guards
        self.basis = basis
        self.grid = GridProducts(basis, free)

    def values(self, states: States) -> list[Array]:
        """Residuals (T, m) of every constraint; exact below `REACH`, bounds from there on."""
        values = []
        for constraint, guard in zip(self.constraints, self.guards, strict=True):
            margins = constraint.margins_within(states, REACH * constraint.scale + guard)
            values.append((margins - guard) / constraint.scale)
        return values

    def rows(self, states: States, index: int, near: Mask) -> ResidualDerivatives:
        """Derivatives of the residuals of one constraint where `near` (T, m) is true."""
        constraint = self.constraints[index]
        times, columns = np.nonzero(near)
        parts = constraint.gradients(states, times, columns)
        scale = constraint.scale[columns][:, None]
        scaled = tuple(None if part is None else part / scale for part in parts)
        return ResidualDerivatives(times, columns, scaled)


def summed_per_instant(
    rows: ResidualDerivatives, weights: Array, samples: int
) -> list[Array | None]:
    """Σ over the rows of each instant of weight·derivative, (T, n) per order."""
    found: list[Array | None] = []
    for part in rows.parts:
        if part is None:
            found.append(None)
            continue
        total = np.zeros((samples, part.shape[1]))
        if len(rows.times):
            starts, instants = _groups(rows.times)
            total[instants] = np.add.reduceat(weights[:, None] * part, starts, axis=0)
        found.append(total)
    return found


def squared_per_instant(
    rows: ResidualDerivatives, weights: Array, samples: int
) -> dict[tuple[int, int], Array]:
    """Σ over the rows of each instant of weight·(gᵢ gⱼᵀ), (T, n, n) per pair of orders."""
    if KERNELS is None:
        return _squared_at_once(rows, weights, samples)
    found = {}
    parts = {i: np.ascontiguousarray(p) for i, p in enumerate(rows.parts) if p is not None}
    times, weights = np.ascontiguousarray(rows.times, dtype=np.int64), np.ascontiguousarray(weights)
    for i, left in parts.items():
        for j, right in parts.items():
            if j >= i:
                n = left.shape[1]
                found[i, j] = np.zeros((samples, n, n))
                KERNELS.call("squared", times, weights, left, right, found[i, j])
    return found


def _squared_at_once(
    rows: ResidualDerivatives, weights: Array, samples: int
) -> dict[tuple[int, int], Array]:
    """`squared_per_instant` in NumPy.

    Rows are laid out by instant, short instants filled with zeros, for one batched product.
    """
    found = {}
    present = [i for i, part in enumerate(rows.parts) if part is not None]
    starts, _ = _groups(rows.times)
    counts = np.diff(np.append(starts, len(rows.times)))
    places = np.arange(len(rows.times)) - np.repeat(starts, counts)
    deepest = int(counts.max(initial=0))
    root = np.sqrt(weights)[:, None]
    laid_out = {}
    for i in present:
        part = rows.parts[i]
        assert part is not None
        laid_out[i] = np.zeros((samples, deepest, part.shape[1]))
        laid_out[i][rows.times, places] = root * part
    for i in present:
        for j in (j for j in present if j >= i):
            found[i, j] = laid_out[i].transpose(0, 2, 1) @ laid_out[j]
    return found


def _groups(times: Indices) -> tuple[Indices, Indices]:
    """Starts of runs of equal times (rows come sorted by time), and those times."""
    if not len(times):
        return np.zeros(0, int), np.zeros(0, int)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(times)) + 1])
    return starts, times[starts]
