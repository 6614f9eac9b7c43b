"""Least values of linear functionals, and of quotients of them, over uncertain inertias.

Rows r(x) φ (a wrench, or mass and first moments of mass) are known for T instants; functionals are
combinations a·r of these few rows, so the large products with φ's bounds are done once per row.

A quotient (a·r φ) / (b·r φ), as the zero-moment point or the centre of mass, is least at the λ with
min_φ (a − λ b)·r φ = 0. That function of λ is concave and falls while b·r φ > 0, so Newton's
iteration from the middle value comes down to its root and gains digits quadratically (Dinkelbach
1967).
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, Piece

_ITERATIONS, _SETTLED = 30, 1e-12


@dataclass(frozen=True)
class _Seen:
    """Rows as one piece sees them: c·r (T, r), D r (T, r, p), E r (T, r, e)."""

    middle: Array
    corners: Array
    axes: Array

    @classmethod
    def by(cls, piece: Piece, rows: Array) -> "_Seen":
        if piece.corners.ndim == 1:
            used = np.flatnonzero(piece.corners)
            corners = rows[..., used] * piece.corners[used]
        else:
            corners = rows @ piece.corners.T
        return cls(rows @ piece.center, corners, rows @ piece.axes.T)

    def least(self, functionals: Array) -> Array:
        """The least of a·r φ (T, m) for `functionals` (m, r)."""
        slack = np.abs(functionals @ self.corners).sum(axis=-1)
        if self.axes.shape[-1]:
            slack = slack + np.linalg.norm(functionals @ self.axes, axis=-1)
        return np.asarray(self.middle @ functionals.T - slack)

    def least_ratio(self, above: Array, below: Array, floor: float) -> tuple[Array, Mask]:
        """The least quotient (T, m) and where it is proper; see `least_ratios`."""
        middle, divisor = self.middle @ above.T, (self.middle @ below)[:, None]
        corners, corners_below = above @ self.corners, (below @ self.corners)[:, None]
        axes, axes_below = above @ self.axes, (below @ self.axes)[:, None]
        positive = (self.least(below[None]) >= floor) & np.ones(len(above), bool)
        ratio = middle / np.maximum(divisor, floor)
        corner = np.empty_like(corners)
        for _ in range(_ITERATIONS):
            np.multiply(ratio[..., None], corners_below, out=corner)
            np.subtract(corners, corner, out=corner)
            sign = np.sign(corner)
            value = middle - ratio * divisor - np.einsum("tmp,tmp->tm", sign, corner)
            slope = divisor - (sign @ corners_below[:, 0, :, None])[..., 0]
            if axes.shape[-1]:
                axis = axes - ratio[..., None] * axes_below
                length = np.linalg.norm(axis, axis=-1)
                value = value - length
                slope = slope - (axis * axes_below).sum(axis=-1) / np.where(length > 0, length, 1.0)
            step = np.where(positive, value / np.maximum(slope, floor), 0.0)
            ratio = ratio + step
            if np.all(np.abs(step) <= _SETTLED * (1.0 + np.abs(ratio))):
                break
        return np.where(positive, ratio, self.least(above) / floor), positive


@dataclass(frozen=True)
class Ratios:
    """Least quotients `values` (T, m), and the piece that bounds each.

    `proper` is false where the divisor may fall below its floor, which then stands for it.
    """

    values: Array
    pieces: Indices
    proper: Mask


def least_values(
    uncertainty: InertiaUncertainty, rows: Array, functionals: Array
) -> tuple[Array, Indices]:
    """The least of a·r φ, and the piece that says so, each (T, m).

    Parameters
    ----------
    rows: r (T, r, P)
    functionals: a (m, r)
    """
    found = np.array([_Seen.by(p, rows).least(functionals) for p in uncertainty.pieces])
    return found.max(axis=0), found.argmax(axis=0)


def least_ratios(
    uncertainty: InertiaUncertainty, rows: Array, above: Array, below: Array, floor: float
) -> Ratios:
    """The least of (a·r φ) / (b·r φ).

    Where the divisor may fall below `floor` (> 0) for an admitted φ, the quotient says little; the
    least of a·r φ over `floor` stands for it, which has its sign while the divisor is positive.

    Parameters
    ----------
    rows: r (T, r, P)
    above, below: a (m, r), b (r,)
    """
    seen = [_Seen.by(piece, rows).least_ratio(above, below, floor) for piece in uncertainty.pieces]
    values, proper = np.array([one[0] for one in seen]), np.array([one[1] for one in seen])
    pieces = values.argmax(axis=0)
    return Ratios(values.max(axis=0), pieces, np.take_along_axis(proper, pieces[None], 0)[0])


def worst_inertias(uncertainty: InertiaUncertainty, y: Array, pieces: Indices) -> Array:
    """φ* (K, P) of functionals y (K, P), each with the piece (K,) that bounds it."""
    phi = np.empty_like(y)
    for index in np.unique(pieces):
        rows = pieces == index
        phi[rows] = uncertainty.pieces[index].worst(y[rows])
    return phi
