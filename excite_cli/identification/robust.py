"""Iteratively reweighted least squares with Huber's weights (1964).

Residuals in units of a robust scale (1.4826 · median absolute deviation) beyond 1.345 count by
1.345/|r| of their square. 95 % efficient where noise is normal.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.identification.factors import Mask
from excite_cli.robot.model import Array

HUBER = 1.345
_MAD = 1.4826


def robust_scale(residuals: Sequence[Array], usable: Sequence[Mask]) -> Array:
    """Robust standard deviation (n,) of residuals (M, n) of several runs."""
    scales = []
    for j in range(residuals[0].shape[1]):
        pieces = zip(residuals, usable, strict=True)
        values = np.concatenate([residual[mask[:, j], j] for residual, mask in pieces])
        scales.append(_MAD * float(np.median(np.abs(values))) if len(values) else 0.0)
    return np.array(scales)


def huber_weights(residual: Array, scale: Array) -> Array:
    """min(1, 1.345/|r|) with r = residual (M, n) / scale (n,)."""
    r = np.abs(residual) / np.maximum(scale, 1e-300)
    return np.minimum(1.0, HUBER / np.maximum(r, HUBER))


def within(residual: Array, scale: Array) -> Mask:
    """Rows (M, n) that count in full: what the curvature of Huber's loss is made of."""
    return np.abs(residual) <= HUBER * np.maximum(scale, 1e-300)
