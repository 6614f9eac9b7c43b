"""The least that linear functionals of uncertain inertias can take over whole intervals of time.

A functional y(s) of φ, enclosed over an interval, is at least

    c·y(s) − ‖D y(s)‖₁ − ‖E y(s)‖₂

for every admitted φ (`dynamics.uncertain_inertias`). Entries of D y that keep their sign over the
interval are ± themselves, so that they join c·y as one polynomial; the others count with the
largest size they can have, which is small since they cross zero. With e the direction of E y in
the middle, ‖E y‖₂ ≤ e·E y + ‖the rest‖² / (2 e·E y).
"""

import numpy as np

from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty, Piece
from excite_cli.proof.taylor import Array, Taylor


def least_of(y: Taylor, uncertainty: InertiaUncertainty) -> Array:
    """Lower bounds (T, m) on y·φ throughout each interval, for functionals y (T, m, P)."""
    return np.max([_piece_least(y, piece) for piece in uncertainty.pieces], axis=0)


def _piece_least(y: Taylor, piece: Piece) -> Array:
    middle = y.through(piece.center[None])[..., 0]
    if np.any(piece.corners):
        spread = y.scaled(piece.corners) if piece.corners.ndim == 1 else y.through(piece.corners)
        middle = middle - _sum_of_sizes(spread)
    least = middle.lower()
    if len(piece.axes):
        least = (middle - _length(y.through(piece.axes))).lower()
    return least


def _sum_of_sizes(z: Taylor) -> Taylor:
    """An upper bound (T, m) on ‖z‖₁ (T, m, P), as a polynomial and a radius."""
    low, high = z.lower(), z.upper()
    sign = np.where(low >= 0, 1.0, np.where(high <= 0, -1.0, 0.0))
    crossing = np.where(sign == 0, np.maximum(-low, high), 0.0)
    signed = z.scaled(sign).summed(-1)
    return signed + crossing.sum(axis=-1)


def _length(z: Taylor) -> Taylor:
    """An upper bound (T, m) on ‖z‖₂ (T, m, P), as a polynomial and a radius."""
    size = np.linalg.norm(z.center, axis=-1, keepdims=True)
    direction = z.center / np.where(size > 0, size, 1.0)
    along = z.times(Taylor.constant(direction)).summed(-1)
    parallel = Taylor(along.terms[..., None], along.radius[..., None]).scaled(direction)
    rest = z - parallel
    across = np.linalg.norm(rest.size, axis=-1)
    least = along.lower()
    beyond = np.where(
        least > across,
        across**2 / np.where(least > across, 2 * least, 1.0),
        across + 2 * np.maximum(-least, 0.0),  # |along| may be −along there
    )
    return along + beyond
