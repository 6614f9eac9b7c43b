"""Covariance of a weighted least-squares estimate when the noise is serially correlated.

With x̂ − x = B Σ_t c_tᵀ e_t/σ², B = (CᵀC/σ²)⁻¹, the covariance is B S B with S = Cᵀ Ω C. Ω follows
from an autoregressive model per joint and run, and from the correlation of its innovations between
joints, in noise that was there before the first sample. Where the periodogram of a residual has
more power than that model (a hum, which it does not resolve), less what the fit has eaten of it, Ω
has that power. What is naive, σ²B, takes 1,200 samples for 1,200 pieces of information; with such
noise they carry the information of some 150.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.sparse import csr_matrix

from excite_cli.identification.factors import Mask, triangle_of
from excite_cli.out_of_core import forget
from excite_cli.robot.model import Array
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# Serially correlated noise: an autoregressive model per joint, its order by AICc.
#
#     e_t = Σ_k a_k e_{t−k} + w_t,    cov(w_t) = `innovation` across joints
#
# Samples that may not be used break the series; only stretches without a gap enter.

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


_MOST_ENLARGED = 4.0
# Frequencies on either side, half a cycle of the run apart, over which a periodogram is averaged: 3
# to 20 cover alike.
_NEIGHBOURS = 12
_STRETCH = 4096  # samples; what is farther apart is independent
_UNSTABLE = 1.0 - 1e-9


@dataclass(frozen=True)
class RunRows:
    """Rows of one run: `columns` (M, n, p), `tau`, `usable` (M, n), `weights` (M, n) or None.

    `rounding`: per joint what is uncertain in torques that come in steps (`rounding_of`).
    `unsure` (u, M, n): how the torques of all runs change by one standard deviation of each figure
    that they are computed with.
    """

    columns: Array
    tau: Array
    usable: Mask
    weights: Array | None = None
    rounding: tuple[csr_matrix | None, ...] = ()
    unsure: Array | None = None

    def residual(self, x: Array) -> Array:
        """τ − C x (M, n), zero where unusable."""
        return np.where(self.usable, self.tau - self.columns @ x, 0.0)


def estimate_covariance(
    runs: Sequence[RunRows], x: Array, inverse: Array, sigma: Array
) -> tuple[Array, float]:
    """Covariance (p, p) of x from the runs it was fitted to, and the effective number of samples.

    Parameters
    ----------
    x: (p,) estimate
    inverse: (p, p) B, of rows divided by sigma; for a robust fit, of its bread
    sigma: (n,) standard deviation of each joint's residual

    With `weights` in a run (robust fits) the weighted residual is what is modelled.

    The number of independent samples is never more than there are. Noise of high frequencies (of
    positions that were differentiated) changes its sign from sample to sample and hardly shows in
    slow columns: these are known better than behind white noise of that size, which the covariance
    holds, but no sample is two.
    """
    meat, white = np.zeros_like(inverse), np.zeros(len(x))
    for own_meat, own_white in each(_meat_of, (x, inverse, sigma), runs):
        meat += own_meat
        white += own_white
    for run in runs:
        for j, rounding in enumerate(run.rounding):
            if rounding is not None:
                columns = np.where(run.usable[:, j, None], run.columns[:, j], 0.0) / sigma[j] ** 2
                if run.weights is not None:
                    columns = columns * run.weights[:, j, None]
                rounded = rounding.T @ columns
                meat += rounded.T @ rounded
    matrix = inverse @ meat @ inverse
    moved = inverse @ _scores(runs, sigma)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = white / np.diag(matrix)
    shares = shares[np.isfinite(shares)]
    count = sum(int(run.usable.sum()) for run in runs)
    samples = count * min(float(np.median(shares)), 1.0) if len(shares) else float("nan")
    return (matrix + matrix.T) / 2 + moved @ moved.T, samples


def _scores(runs: Sequence[RunRows], sigma: Array) -> Array:
    """Σ_t c_tᵀ Δτ_t/σ² (p, u) of the changes that all runs have in common."""
    total: Array | float = 0.0
    for run in runs:
        if run.unsure is not None:
            columns = np.where(run.usable[..., None], run.columns, 0.0) / np.square(sigma)[:, None]
            if run.weights is not None:
                columns = columns * run.weights[..., None]
            total = total + np.einsum("mnp,umn->pu", columns, run.unsure)
            forget()
    return np.asarray(total) if np.ndim(total) else np.zeros((runs[0].columns.shape[2], 0))


def _meat_of(shared: tuple[Array, Array, Array], run: RunRows, tell: Tell) -> tuple[Array, Array]:
    """What a run adds to the sandwich's inside (p, p), and to white noise's share (p,)."""
    x, inverse, sigma = shared
    residual = run.residual(x)
    if run.weights is not None:
        residual = residual * run.weights
    noise = noise_of(residual, run.usable)
    root = _root(inverse)
    own = np.sqrt(np.diag(noise.innovation) * [_gain(each) for each in noise.polynomials])
    meat, white = np.zeros_like(inverse), np.zeros(len(x))
    for start in range(0, len(residual), _STRETCH):
        cut = slice(start, start + _STRETCH)
        usable = run.usable[cut]
        columns = np.where(usable[..., None], run.columns[cut], 0.0) / sigma[:, None]
        stretch = noise, residual[cut], usable
        more = [_more(*stretch, j, columns[:, j] @ root) for j in range(len(sigma))]
        meat += _meat(noise, columns / sigma[:, None], np.array(more))
        scores = (columns @ inverse) * (own / sigma)[:, None]
        white += np.square(scores).sum(axis=(0, 1))
        forget()
    return meat, white


def _meat(noise: Noise, columns: Array, more: Array) -> Array:
    """Σ_t,s c_t Ω_ts c_sᵀ (p, p), with Ω of the noise with so many times more power (n, F).

    The noise was there before the first sample: so columns are spread back before it as well.
    """
    count = 2 * (more.shape[1] - 1)
    before = np.zeros((count - len(columns), *columns.shape[1:]))
    spread = rfft(noise.spread_back(np.concatenate([before, columns])), axis=0)
    spread *= np.sqrt(more.T)[:, :, None]
    spread[1:-1] *= np.sqrt(2.0)  # frequencies that stand for two
    both = np.concatenate([spread.real, spread.imag])
    mixed = np.einsum("fjp,jk->fkp", both, _root(noise.innovation)).reshape(-1, columns.shape[2])
    return np.asarray(mixed.T @ mixed / count)


def _root(matrix: Array) -> Array:
    """B with B Bᵀ a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _more(noise: Noise, residual: Array, usable: Mask, joint: int, leverage: Array) -> Array:
    """How many times more power (F,) residuals of a joint have than the model says; 1 at least.

    The periodogram of a residual over what is expected of it, Σ_k r_k w_k exp(−iωk) with r the
    autocovariance of the model and w that of the mask, less what the fit has eaten: with L Lᵀ the
    hat matrix of `leverage` L (M, p), the share ‖DFT L‖²/M at each frequency.
    """
    at, own = usable[:, joint], noise.innovation[joint, joint]
    count = 2 * next_fast_len(len(residual), real=True)
    spectrum = own / np.square(np.abs(rfft(noise.polynomials[joint], count)))
    gate = np.square(np.abs(rfft(at.astype(float), count)))
    expected = np.maximum(rfft(irfft(spectrum, count) * irfft(gate, count)).real, 1e-300)
    eaten = np.square(np.abs(rfft(leverage, count, axis=0))).sum(axis=1) / max(int(at.sum()), 1)
    left = 1.0 - np.minimum(_smooth(eaten), 1.0 - 1.0 / _MOST_ENLARGED)
    power = np.square(np.abs(rfft(residual[:, joint], count)))
    return np.maximum(_smooth(power) / (_smooth(expected) * left), 1.0)


def _smooth(spectrum: Array) -> Array:
    """Means over `_NEIGHBOURS` frequencies on either side, which the ends reflect."""
    mode: Any = "reflect" if len(spectrum) > _NEIGHBOURS else "edge"
    wide = np.pad(spectrum, _NEIGHBOURS, mode=mode)
    return np.convolve(wide, np.ones(2 * _NEIGHBOURS + 1) / (2 * _NEIGHBOURS + 1), "valid")


def _gain(polynomial: Array) -> float:
    """Variance of an autoregressive series per variance of its innovations: Π 1/(1 − k²).

    k are the reflection coefficients, from the highest order down (Levinson, backwards).
    """
    gain, own = 1.0, np.asarray(polynomial[1:], dtype=float)
    while len(own):
        k = float(np.clip(own[-1], -_UNSTABLE, _UNSTABLE))  # rounding may reach 1
        gain /= 1.0 - k * k
        own = (own[:-1] - k * own[-2::-1]) / (1.0 - k * k)
    return gain
