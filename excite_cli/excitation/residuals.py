"""Constraints as an optimiser wants them: dimensionless, guarded, and fast to differentiate.

A residual is (margin − guard) / scale, admissible where not negative. The guard keeps what lies
between the instants of the grid: exact for bounds on a Fourier series (its sampling factor), an
estimate for the others, raised when a finer grid shows it to be too small.

Derivatives with respect to q at one instant reach the coefficients through the same basis row, so
weighted sums over thousands of rows collapse to one matrix product per pair of derivative orders:
Σ_t (b_t b_tᵀ) ⊗ G_t.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.kernels.compiled import KERNELS
from excite_cli.trajectory.base import Basis

Mask = NDArray[np.bool_]

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
