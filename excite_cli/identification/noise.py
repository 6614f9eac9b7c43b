"""Serially correlated noise: an autoregressive model per joint, its order by AICc.

    e_t = Σ_k a_k e_{t−k} + w_t,    cov(w_t) = `innovation` across joints

Samples that may not be used break the series; only stretches without a gap enter.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.identification.factors import Mask, triangle_of
from excite_cli.robot.model import Array

_MOST_LAGS = 12


@dataclass(frozen=True)
class Noise:
    """Of one run: `polynomials` per joint (1, −a_1, …), `innovation` (n, n) covariance of w."""

    polynomials: tuple[Array, ...]
    innovation: Array

    def spread_back(self, x: Array) -> Array:
        """A⁻ᵀ x along time for x (M, n, …), with noise covariance A⁻¹ A⁻ᵀ per unit innovation."""
        from scipy.signal import lfilter  # takes a second to import

        out = np.empty_like(x)
        for j, polynomial in enumerate(self.polynomials):
            out[:, j] = lfilter([1.0], polynomial, x[::-1, j], axis=0)[::-1]
        return out


def noise_of(residual: Array, usable: Mask) -> Noise:
    """Fit the model to residuals (M, n) of one run."""
    clean = np.where(usable, residual, 0.0)
    polynomials = [_polynomial(e, good) for e, good in zip(residual.T, usable.T, strict=True)]
    white = [
        np.convolve(e, polynomial)[: len(e)]
        for e, polynomial in zip(clean.T, polynomials, strict=True)
    ]
    good = _after_gaps(usable, max(map(len, polynomials)))
    innovations = np.where(good, np.stack(white, axis=1), 0.0)
    counts = good.T.astype(float) @ good
    covariance = innovations.T @ innovations / np.maximum(counts, 1.0)
    return Noise(tuple(polynomials), _positive(covariance))


def _after_gaps(usable: Mask, lags: int) -> Mask:
    """Samples whose `lags` − 1 predecessors can be used as well."""
    good = usable.copy()
    for k in range(1, lags):
        good[k:] &= usable[:-k]
        good[:k] = False
    return good


def _polynomial(e: Array, usable: Mask) -> Array:
    """(1, −a_1, …, −a_p) with the p of the least AICc, stable."""
    most = min(_MOST_LAGS, int(usable.sum()) // 20)
    good = _after_gaps(usable[:, None], most + 1)[:, 0]
    count = int(good.sum())
    if most < 1 or count < 4 * (most + 2):
        return np.ones(1)
    at = np.flatnonzero(good)
    lagged = e[at[:, None] - np.arange(most + 1)]
    triangle = triangle_of(np.column_stack([lagged[:, 1:], lagged[:, 0]]))
    squares = np.cumsum(np.square(triangle[::-1, -1]))[::-1]  # what is left after p lags
    if squares[0] <= 0:
        return np.ones(1)
    parameters = np.arange(most + 1) + 1
    likelihood = count * np.log(np.maximum(squares, 1e-300) / count)
    aicc = likelihood + 2 * parameters * count / np.maximum(count - parameters - 1, 1)
    p = int(np.argmin(aicc))
    if p == 0:
        return np.ones(1)
    a = np.linalg.lstsq(triangle[:p, :p], triangle[:p, -1], rcond=None)[0]
    return _stable(np.append(1.0, -a))


def _stable(polynomial: Array) -> Array:
    """Roots drawn into a circle of radius 0.998, so that variances stay finite."""
    radius = float(np.abs(np.roots(polynomial)).max(initial=0.0))
    if radius <= 0.998:
        return polynomial
    return polynomial * (0.998 / radius) ** np.arange(len(polynomial))


def _positive(covariance: Array) -> Array:
    """The nearest positive semidefinite matrix with the same diagonal, roughly."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T
