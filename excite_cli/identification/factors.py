"""Least squares through triangular factors, kept per run and joint.

For rows [C τ] of one run and joint, R with RᵀR = [C τ]ᵀ[C τ] holds all that a least-squares fit can
ask for. Factors of many runs and joints are stacked and factored again (TSQR), so that another
weight per joint, or one run left out, costs nothing in samples. The condition number is not
squared, as it would be with normal equations.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Mask as Mask
from excite_cli.robot.model import Array

# Directions weaker than this, with columns of unit norm, are not seen by the data: torque is not
# known to a ten-millionth. With 1e-9 one sample of smoothed sign at rest held Coulomb friction and
# offset of a joint apart, by 2e6 N·m each.
BLIND = 1e-7
_MOST_KEPT = 128


@dataclass(frozen=True)
class Solution:
    """x (p,) of least norm (columns scaled), and what the data say about it.

    `inverse` (p, p) of CᵀC on the directions that are seen; `seen` (p,): parameters that have no
    part in a direction which the data do not show.
    """

    x: Array
    inverse: Array
    seen: Mask


def triangle_of(rows: Array) -> Array:
    """R with RᵀR = rowsᵀ rows."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def run_factors(columns: Array, tau: Array, usable: Mask, weights: Array | None = None) -> Array:
    """R (n, p+1, p+1) of the usable rows [C τ] of one run, per joint.

    `columns` (M, n, p), `tau` and `usable` (M, n); `weights` (M, n) multiply the squared rows.
    """
    scale = usable.astype(float) if weights is None else usable * np.sqrt(weights)
    rows = np.concatenate([columns, np.where(usable, tau, 0.0)[..., None]], axis=2)
    rows = np.where(usable[..., None], rows, 0.0) * scale[..., None]
    width = rows.shape[2]
    if len(rows) < width:
        rows = np.concatenate([rows, np.zeros((width - len(rows), *rows.shape[1:]))])
    return triangle_of(rows.transpose(1, 0, 2))


def together(factors: Iterable[Array]) -> list[Array]:
    """The same factors (n, q, q), those of many runs made one: memory does not grow with them."""
    kept: list[Array] = []
    for factor in factors:
        kept.append(factor)
        if len(kept) == _MOST_KEPT:
            kept = [triangle_of(np.concatenate(kept, axis=1))]
    return kept


def stacked(factors: Sequence[Array], sigma: Array, extra: Array | None = None) -> Array:
    """One factor (p+1, p+1) of all runs, joints divided by `sigma` (n,); `extra` rows below."""
    rows = [(factor / sigma[:, None, None]).reshape(-1, factor.shape[-1]) for factor in factors]
    if extra is not None:
        rows.append(extra)
    return triangle_of(np.concatenate(rows))


def solve(factor: Array) -> Solution:
    """Least squares from R (p+1, p+1) of [C τ], columns scaled to unit norm."""
    scale, left, values, directions, kept = _decomposed(factor)
    inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    x = directions.T @ (inverse * (left.T @ factor[:-1, -1])) / scale
    half = directions.T * inverse / scale[:, None]
    blind = np.linalg.norm(directions[~kept], axis=0) if (~kept).any() else np.zeros(len(x))
    return Solution(x, half @ half.T, blind < 1e-6)


def undecided(factor: Array, x: Array) -> Array:
    """Covariance (p, p) of x along the directions N (p, b) that R does not show: 2 P diag(x²) P.

    P = N Nᵀ, with columns scaled to unit norm. Two parameters of one column have half of their sum
    each, and either may be all of it: ± as much as each has.
    """
    scale, _, _, directions, kept = _decomposed(factor)
    blind = directions[~kept].T
    half = blind @ (blind.T * (np.sqrt(2.0) * scale * x)) / scale[:, None]
    return np.asarray(half @ half.T)


def _decomposed(factor: Array) -> tuple[Array, Array, Array, Array, Mask]:
    """Norms of C's columns, its singular values and vectors with these one, and which are seen."""
    norms = np.linalg.norm(factor[:-1, :-1], axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    left, values, directions = np.linalg.svd(factor[:-1, :-1] / scale)
    kept = values > BLIND * max(float(values[0]) if len(values) else 0.0, 1e-300)
    return scale, left, values, directions, kept


def residual_squares(factors: Sequence[Array], x: Array) -> Array:
    """‖τ − C x‖² per joint (n,), over all runs."""
    ends = np.append(-x, 1.0)
    return sum(
        (np.square(factor @ ends).sum(axis=1) for factor in factors), np.zeros(len(factors[0]))
    )
