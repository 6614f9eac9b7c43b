"""Serially correlated noise: an autoregression per joint, and the whitening it gives.

e_t = Σ_k c_k e_{t−k} + w_t, w white with variance s². Coefficients come from least squares over all
runs at once; the order is the one with the smallest corrected Akaike criterion.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from excite_cli.arrays import Array, Indices, Mask

HIGHEST_ORDER = 12
_SHRINK = 0.995  # roots are kept within this circle
# Averages there are of fewer samples, and of noise with a memory one thinks too well.
_AFTER_GAPS = 2.0
# White noise added to the residual, as a share of its variance. Torque that somebody low-passed
# before holds nothing at high frequency; whitening must not trust that band a million times more.
_NUGGET = 0.03


@dataclass(frozen=True)
class NoiseModel:
    """Coefficients (p_j,) and innovation σ_j [N·m] of every joint.

    `after_gaps`: how many times larger innovations are in the rows that follow a gap within the
    highest order. Real friction has transients at reversals that no model holds.
    """

    coefficients: tuple[Array, ...]
    sigma: Array
    after_gaps: Array | None = None

    @classmethod
    def white(cls, sigma: Array) -> "NoiseModel":
        """Independent samples."""
        return cls(tuple(np.zeros(0) for _ in sigma), np.asarray(sigma, dtype=float))

    def whitened(self, x: Array, joint: int, usable: Mask) -> Array:
        """The usable rows (K, …) of x (M, …), a run's rows of one joint, with unit innovations."""
        return self.whitening(joint, usable)(x)

    def whitening(self, joint: int, usable: Mask) -> "Whitening":
        """How the usable rows of a run's columns of one joint are whitened.

        Of each what those of the p rows before it that are usable do not predict. Where a joint
        stands there are gaps; without the rows after them a motion that often turns round would
        keep a third of its samples, and nothing of what happens at reversals.
        """
        order, at = len(self.coefficients[joint]), np.flatnonzero(usable)
        before = np.zeros((len(usable), order), dtype=bool)
        for k in range(1, order + 1):
            before[k:, k - 1] = usable[:-k]
        before = before[at]
        spread = np.full(len(at), self.sigma[joint])
        broken = np.flatnonzero(~before.all(axis=1))
        # As numbers: rows of truth values are slow to compare.
        packed = np.packbits(before[broken], axis=1)
        numbers = packed @ (256 ** np.arange(packed.shape[1]))
        after = []
        for number in np.unique(numbers).tolist():
            rows = broken[numbers == number]
            lags = np.flatnonzero(before[rows[0]]) + 1
            by, spread[rows] = self._predictor(joint, lags)
            after.append((rows, lags, by))
        if self.after_gaps is not None:
            spread[self.follow_gaps(usable)] *= self.after_gaps[joint]
        return Whitening(self.coefficients[joint], at, tuple(after), spread)

    def follow_gaps(self, usable: Mask) -> Mask:
        """Which of the usable rows (K,) follow a gap, or the start, within the highest order."""
        order = max(len(c) for c in self.coefficients)
        touched = np.convolve(~usable, np.ones(order + 1))[: len(usable)] > 0.5
        touched[:order] = True
        return touched[usable]

    @cached_property
    def _predictors(self) -> dict[tuple[int, bytes], tuple[Array, float]]:
        """Many runs have the same gaps."""
        return {}

    def _predictor(self, joint: int, lags: Indices) -> tuple[Array, float]:
        """Coefficients of the samples at these lags, and the standard deviation of what is left."""
        key = joint, lags.tobytes()
        if key not in self._predictors:
            covariances = self._autocovariances[joint]
            among, cross = covariances[np.abs(lags[:, None] - lags)], covariances[lags]
            by = np.asarray(np.linalg.lstsq(among, cross, rcond=1e-12)[0])
            left = max(float(covariances[0] - by @ cross), float(self.sigma[joint]) ** 2)
            self._predictors[key] = by, float(np.sqrt(left))
        return self._predictors[key]

    @cached_property
    def _autocovariances(self) -> tuple[Array, ...]:
        """Of every joint at lags 0 to p (Yule and Walker): r_k = Σ c_i r_|k−i| + s² δ_k0."""
        found = []
        for coefficients, sigma in zip(self.coefficients, self.sigma, strict=True):
            order = len(coefficients)
            equations = np.eye(order + 1)
            for k in range(order + 1):
                for i, c in enumerate(coefficients, 1):
                    equations[k, abs(k - i)] -= c
            found.append(np.linalg.solve(equations, sigma**2 * np.eye(order + 1)[0]))
        return tuple(found)

    def levels(self) -> Array:
        """Standard deviation (n,) of the noise itself."""
        return np.sqrt([covariances[0] for covariances in self._autocovariances])


@dataclass(frozen=True)
class Whitening:
    """The rows `at` (K,) that are usable and the `spread` (K,) that innovations have there.

    `coefficients` (p,) predict them; `after`: rows that follow a gap, the lags that there are
    before them, and the coefficients of these.
    """

    coefficients: Array
    at: Indices
    after: tuple[tuple[Indices, Indices, Array], ...]
    spread: Array

    def __call__(self, x: Array) -> Array:
        """The usable rows (K, …) of x (M, …), with unit innovations."""
        x = np.asarray(x, dtype=float)
        rest = x.copy()
        for k, c in enumerate(self.coefficients, 1):  # lfilter goes column by column
            rest[k:] -= c * x[: max(len(x) - k, 0)]
        rest = rest[self.at]
        for rows, lags, by in self.after:
            rest[rows] = x[self.at[rows]] - sum(
                c * x[self.at[rows] - k] for k, c in zip(lags, by, strict=True)
            )
        rest /= self.spread.reshape(-1, *np.ones(x.ndim - 1, dtype=int))
        return rest


def fit_noise(residuals: Sequence[Array], usable: Sequence[Mask]) -> NoiseModel:
    """Autoregressions for residuals (M, n) of several runs, and what is more after gaps."""
    joints = range(residuals[0].shape[1])
    found = [
        _autoregression([r[:, j] for r in residuals], [u[:, j] for u in usable]) for j in joints
    ]
    model = NoiseModel(tuple(c for c, _ in found), np.array([s for _, s in found]))
    return replace(
        model, after_gaps=np.array([_after_gaps(model, residuals, usable, j) for j in joints])
    )


def _after_gaps(
    model: NoiseModel, residuals: Sequence[Array], usable: Sequence[Mask], joint: int
) -> float:
    """Innovations after gaps over all others, root mean squares; `_AFTER_GAPS` at least."""
    pairs = list(zip(residuals, usable, strict=True))
    rows = np.concatenate([model.whitened(r[:, joint], joint, u[:, joint]) for r, u in pairs])
    near = np.concatenate([model.follow_gaps(u[:, joint]) for _, u in pairs])
    if not near.any() or near.all():
        return 1.0
    return float(max(_AFTER_GAPS, np.sqrt(np.mean(rows[near] ** 2) / np.mean(rows[~near] ** 2))))


def _autoregression(series: list[Array], usable: list[Mask]) -> tuple[Array, float]:
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
        c = _not_quiet_at_zero(gram[:p, :p], cross[:p])
        left = max(float(energy - 2 * c @ cross[:p] + c @ gram[:p, :p] @ c), 1e-300)
        criterion = count * np.log(left / count) + 2 * (p + 1) * count / (count - p - 2)
        if criterion < best - 1e-9:
            best, coefficients, variance = criterion, np.asarray(c), left / (count - p)
    return _stable(coefficients), float(np.sqrt(variance) + 1e-12)


def _not_quiet_at_zero(gram: Array, cross: Array) -> Array:
    """Least squares with Σ c ≥ 0: slow noise is no less than white noise of the innovation.

    The many columns that are in the model while noise is measured take slow noise up, and a
    constant would be judged by what they leave.
    """
    c = np.linalg.lstsq(gram, cross, rcond=1e-12)[0]
    if c.sum() < 0.0:
        along = np.linalg.lstsq(gram, np.ones(len(c)), rcond=1e-12)[0]
        c -= along * c.sum() / along.sum()
    return np.asarray(c)


def _stable(coefficients: Array) -> Array:
    roots = np.roots([1.0, *-coefficients])
    sizes = np.abs(roots)
    if sizes.max(initial=0.0) <= _SHRINK:
        return coefficients
    shrunk = roots * np.minimum(_SHRINK / np.maximum(sizes, 1e-300), 1.0)
    return np.asarray(-np.real(np.poly(shrunk))[1:])
