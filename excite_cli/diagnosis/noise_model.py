"""Serially correlated noise: an autoregression per joint, and the whitening it gives.

e_t = Σ_k c_k e_{t−k} + w_t, w white with variance s². Coefficients come from least squares over all
runs at once; the order is the one with the smallest corrected Akaike criterion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from excite_cli.robot.model import Array

HIGHEST_ORDER = 12
_RESPONSE = 2000  # samples after which an impulse has died away
_SHRINK = 0.995  # roots are kept within this circle
# White noise added to the residual, as a share of its variance. Torque that somebody low-passed
# before holds nothing at high frequency; whitening must not trust that band a million times more.
_NUGGET = 0.03


@dataclass(frozen=True)
class NoiseModel:
    """Coefficients (p_j,) and innovation σ_j [N·m] of every joint."""

    coefficients: tuple[Array, ...]
    sigma: Array

    @property
    def order(self) -> int:
        """Highest order: so many samples at the start of a run are lost."""
        return max(len(c) for c in self.coefficients)

    @classmethod
    def white(cls, sigma: Array) -> "NoiseModel":
        """Independent samples."""
        return cls(tuple(np.zeros(0) for _ in sigma), np.asarray(sigma, dtype=float))

    def whitened(self, x: Array, joint: int) -> Array:
        """Rows (M − order, …) of x (M, …), a run's rows of one joint, with unit innovations."""
        x, order = np.asarray(x, dtype=float), self.order
        rest = x[order:].copy()
        for k, c in enumerate(self.coefficients[joint], 1):  # lfilter goes column by column
            rest -= c * x[order - k : max(len(x) - k, 0)]
        rest /= self.sigma[joint]
        return rest

    def clean(self, usable: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whitened rows (M − order,) that no unusable sample has touched."""
        touched = np.convolve(~usable, np.ones(self.order + 1))[: len(usable)] > 0.5
        return ~touched[self.order :]

    def levels(self) -> Array:
        """Standard deviation (n,) of the noise itself, from its response to an impulse."""
        impulse = np.zeros(_RESPONSE)
        impulse[0] = 1.0
        responses = [
            lfilter([1.0], np.concatenate([[1.0], -c]), impulse) for c in self.coefficients
        ]
        return self.sigma * np.sqrt(np.sum(np.square(responses), axis=1))


def fit_noise(residuals: Sequence[Array], usable: Sequence[NDArray[np.bool_]]) -> NoiseModel:
    """Autoregressions for residuals (M, n) of several runs."""
    joints = residuals[0].shape[1]
    found = [
        _autoregression([r[:, j] for r in residuals], [u[:, j] for u in usable])
        for j in range(joints)
    ]
    return NoiseModel(tuple(c for c, _ in found), np.array([s for _, s in found]))


def _autoregression(series: list[Array], usable: list[NDArray[np.bool_]]) -> tuple[Array, float]:
    shortest = min(len(s) for s in series)
    most = int(min(HIGHEST_ORDER, max(0, shortest // 8)))
    rows, targets = [], []
    for s, u in zip(series, usable, strict=True):
        windows = np.lib.stride_tricks.sliding_window_view(s, most + 1)
        good = np.lib.stride_tricks.sliding_window_view(u, most + 1).all(axis=1)
        rows.append(windows[good, :-1][:, ::-1])
        targets.append(windows[good, -1])
    past, now = np.concatenate(rows), np.concatenate(targets)
    count = len(now)
    if count <= 3 * most + 4:
        kept = np.concatenate([s[u] for s, u in zip(series, usable, strict=True)])
        return np.zeros(0), float(np.sqrt(np.mean(kept**2)) + 1e-12) if len(kept) else 1.0
    gram, cross, energy = past.T @ past, past.T @ now, float(now @ now)
    nugget = _NUGGET * energy
    gram[np.diag_indices(most)] += nugget
    energy += nugget
    best, variance = np.inf, energy / count
    coefficients: Array = np.zeros(0)
    for p in range(most + 1):
        c = np.linalg.lstsq(gram[:p, :p], cross[:p], rcond=1e-12)[0] if p else np.zeros(0)
        left = max(float(energy - 2 * c @ cross[:p] + c @ gram[:p, :p] @ c), 1e-300)
        criterion = count * np.log(left / count) + 2 * (p + 1) * count / (count - p - 2)
        if criterion < best - 1e-9:
            best, coefficients, variance = criterion, np.asarray(c), left / (count - p)
    return _stable(coefficients), float(np.sqrt(variance) + 1e-12)


def _stable(coefficients: Array) -> Array:
    if not len(coefficients):
        return coefficients
    roots = np.asarray(np.roots(np.concatenate([[1.0], -coefficients])), dtype=complex)
    sizes = np.abs(roots)
    if sizes.max(initial=0.0) <= _SHRINK:
        return coefficients
    shrunk = roots * np.where(sizes > _SHRINK, _SHRINK / np.maximum(sizes, 1e-300), 1.0)
    return np.asarray(-np.real(np.poly(shrunk))[1:])
