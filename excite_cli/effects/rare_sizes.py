"""How far several fitted parameters may be off by chance: lengths and distances in their errors."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


# Chance of a true effect to look impossible by the error of the fit, and be refused.
_CHANCE = 0.01


@cache
def two_deviations(count: int) -> float:
    """Length that `count` unit normals exceed as rarely as one exceeds two deviations."""
    from scipy.stats import chi2  # slow to import

    return float(np.sqrt(chi2.isf(chi2.sf(4.0, 1), count)))


@cache
def unlikely_distance(count: int) -> float:
    """χ² distance that `count` parameters of a possible effect seldom have from possible ones."""
    from scipy.stats import chi2  # slow to import

    return float(chi2.isf(_CHANCE, count))


def half_of(covariance: Array) -> Array:
    """B (size, size) with B Bᵀ a `covariance`, however ill-conditioned."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale[scale < 1e-150] = 1.0
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.maximum(values, 1e-12)))


def nearest_of_sign(values: Array, covariance: Array, signed: NDArray[np.bool_]) -> Array:
    """The nearest parameters (p,) of which those that are `signed` are not negative.

    minimise (x − values)ᵀ covariance⁻¹ (x − values) subject to x_k ≥ 0, a bounded least-squares
    problem.
    """
    from scipy.optimize import lsq_linear  # slow to import

    whiten = np.linalg.inv(half_of(covariance))
    lower = np.where(signed, 0.0, -np.inf)
    found = lsq_linear(
        whiten, whiten @ values, (lower, np.full(len(values), np.inf)), method="bvls"
    )
    return np.asarray(np.where(signed & (found.x <= 1e-12 * np.abs(values)), 0.0, found.x))
