"""Covariance of a weighted least-squares estimate when the noise is serially correlated.

With x̂ − x = B Σ_t c_tᵀ e_t/σ², B = (CᵀC/σ²)⁻¹, the covariance is B S B with S = Cᵀ Ω C. Ω follows
from an autoregressive model per joint and run, and from the correlation of its innovations between
joints. Residuals are smaller than the noise, for the fit has eaten some of it; per joint
E‖e‖² = tr Ω − tr(H Ω), and Ω is enlarged accordingly. What is naive, σ²B, takes 1,200 samples for
1,200 pieces of information; with such noise they carry the information of some 150.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from excite_cli.identification.factors import Mask
from excite_cli.identification.noise import Noise, noise_of
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

MOST_ENLARGED = 4.0
_UNSTABLE = 1.0 - 1e-9


@dataclass(frozen=True)
class Rows:
    """Rows of one run: `columns` (M, n, p), `tau`, `usable` (M, n), `weights` (M, n) or None.

    `rounding`: per joint what is uncertain in torques that come in steps (`rounding_of`).
    """

    columns: Array
    tau: Array
    usable: Mask
    weights: Array | None = None
    rounding: tuple[csr_matrix | None, ...] = ()

    def residual(self, x: Array) -> Array:
        """τ − C x (M, n), zero where unusable."""
        return np.where(self.usable, self.tau - self.columns @ x, 0.0)


@dataclass(frozen=True)
class Covariance:
    """`matrix` (p, p); `noises` per run; `samples` the effective number of independent samples.

    That is never more than there are samples. Noise of high frequencies (of positions that were
    differentiated) changes its sign from sample to sample and hardly shows in slow columns: these
    are known better than behind white noise of that size, which `matrix` holds, but no sample is
    two.
    """

    matrix: Array
    noises: tuple[Noise, ...]
    samples: float


def estimate_covariance(runs: Sequence[Rows], x: Array, inverse: Array, sigma: Array) -> Covariance:
    """Covariance of x from the runs it was fitted to.

    Parameters
    ----------
    x: (p,) estimate
    inverse: (p, p) B, of rows divided by sigma; for a robust fit, of its bread
    sigma: (n,) standard deviation of each joint's residual

    With `weights` in a run (robust fits) the weighted residual is what is modelled.
    """
    p, n = len(x), len(sigma)
    noises, meat, trace = [], np.zeros((p, p)), np.zeros(n)
    eaten, white, plain = np.zeros(n), np.zeros(p), 0
    parts, spool = [], Spool()
    for run, own in zip(runs, each(_part, (x, inverse, sigma), runs), strict=True):
        noises.append(own.noise)
        parts.append((spool.keep(own.spread), own.noise))
        eaten += own.eaten
        trace += own.trace
        white += own.white
        plain += int(run.usable.sum())
    ratio = np.clip(eaten / np.maximum(trace, 1e-300), 0.0, 1.0 - 1.0 / MOST_ENLARGED)
    enlarged = np.sqrt(1.0 / (1.0 - ratio))
    for own in each(_meat, enlarged, parts):
        meat += own
    for run in runs:
        for j, rounding in enumerate(run.rounding):
            if rounding is not None:
                x = np.where(run.usable[:, j, None], run.columns[:, j], 0.0) / sigma[j] ** 2
                rounded = rounding.T @ (x if run.weights is None else x * run.weights[:, j, None])
                meat += rounded.T @ rounded
    matrix = inverse @ meat @ inverse
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = white / np.diag(matrix)
    shares = shares[np.isfinite(shares)]
    samples = plain * min(float(np.median(shares)), 1.0) if len(shares) else float("nan")
    return Covariance((matrix + matrix.T) / 2, tuple(noises), samples)


@dataclass(frozen=True)
class _Part:
    """What a run adds: its noise, its columns spread by it (M, n, p), and sums."""

    noise: Noise
    spread: Array
    eaten: Array
    trace: Array
    white: Array


def _meat(enlarged: Array, part: tuple[Array, Noise], tell: Tell) -> Array:
    """What a run adds to the sandwich's inside (p, p)."""
    spread, noise = part
    covariance = noise.innovation * np.outer(enlarged, enlarged)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    mixed = np.einsum("tjp,jk->tkp", spread, root).reshape(-1, spread.shape[2])
    return np.asarray(mixed.T @ mixed)


def _part(shared: tuple[Array, Array, Array], run: Rows, tell: Tell) -> _Part:
    x, inverse, sigma = shared
    residual = run.residual(x)
    if run.weights is not None:
        residual = residual * run.weights
    noise = noise_of(residual, run.usable)
    columns = np.where(run.usable[..., None], run.columns, 0.0)
    spread = noise.spread_back(columns) / np.square(sigma)[:, None]
    own = np.diag(noise.innovation)
    projected = spread @ inverse
    variance = own * np.array([_gain(a) for a in noise.polynomials])
    scores = (columns @ inverse) * (np.sqrt(variance) / np.square(sigma))[:, None]
    return _Part(
        noise,
        spread,
        own * np.einsum("tjp,tjp->j", projected, spread) * np.square(sigma),
        variance * run.usable.sum(axis=0),
        np.square(scores).sum(axis=(0, 1)),
    )


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
