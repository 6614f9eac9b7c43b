"""The period of a repeated motion to a fraction of a sample, from positions with gaps.

Samples one period apart are alike. d(L) = mean |q(t+L) − q(t)|² over the samples that are known at
both ends has its first deep minimum near the period P, to whole samples. To first order
q(t + L) − q(t) = v(t) (L − kP) for a lag L close to k periods: least squares over many k give P.
"""

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.model import Array

# Positions one period apart differ by less than this share of their range.
_ALIKE = 0.02
# A lag counts if at least this share of the known samples has a partner.
_FEWEST = 1 / 8
_STEPS = 4
_MULTIPLES = 8  # periods that are looked at in a step, farther away from step to step
_SLOPE = 200  # parts of a period over which a speed is taken


def exact_period(q: Array, known: NDArray[np.bool_]) -> float | None:
    """Samples per period of q (T, n), if two whole periods are there, else None.

    known: (T,) which samples may be looked at; the others may hold anything. A run with gaps may
    have ended with one.
    """
    if known.sum() < 16:
        return None
    spread = q[known].std(axis=0)
    moved = spread > 1e-6
    if not moved.any():
        return None
    x = (q[:, moved] - q[known][:, moved].mean(axis=0)) / spread[moved]
    x = np.where(known[:, None], x, 0.0)
    apart = _apart(x, known)
    far = np.flatnonzero(np.isfinite(apart) & (apart > 0.5))
    if not len(far):
        return None
    first = int(far[0])
    good = np.flatnonzero(apart[first:] < _ALIKE**2)
    if not len(good):
        return None
    start = first + int(good[0])
    rising = np.flatnonzero(np.diff(apart[start:]) > 0)
    whole = start + (int(rising[0]) if len(rising) else 0)
    return _refined(x, known, float(whole))


def _apart(x: Array, known: NDArray[np.bool_]) -> Array:
    """Mean squared difference per joint of samples L apart, L up to half; inf if too few are."""
    size, weight = len(x), known.astype(float)
    own = np.fft.rfft(x, 2 * size, axis=0)
    mask = np.fft.rfft(weight, 2 * size)
    squares = np.fft.rfft(np.square(x).sum(axis=1), 2 * size)
    # Σ w_t |x_{t+L}|² + w_{t+L} |x_t|² − 2 x_t·x_{t+L}, even in L.
    spectrum = 2.0 * (squares.conj() * mask).real - 2.0 * np.square(np.abs(own)).sum(axis=1)
    longest_gap = int(np.diff(np.flatnonzero(known)).max()) - 1
    lags = slice(0, (size + longest_gap) // 2 + 1)
    total = np.fft.irfft(spectrum)[lags]
    pairs = np.fft.irfft(np.square(np.abs(mask)))[lags]
    enough = pairs > max(_FEWEST * weight.sum(), 1.0)
    return np.where(enough, total / np.maximum(pairs, 1.0) / x.shape[1], np.inf)


def _multiples(most: int, step: int) -> list[int]:
    """How many periods apart samples are compared: a few cases, up to all that a step dares.

    A lag is off by k times the error of the period; so it is known to that share before.
    """
    farthest = min(most, _MULTIPLES * 4**step)
    return sorted({round(k) for k in np.linspace(1, farthest, min(farthest, _MULTIPLES))})


def _refined(x: Array, known: NDArray[np.bool_], period: float) -> float:
    """The period that fits best at all its multiples."""
    half = max(1, round(period / _SLOPE))
    v, sure = np.zeros_like(x), np.zeros(len(x), bool)
    v[half:-half] = (x[2 * half :] - x[: -2 * half]) / (2 * half)
    sure[half:-half] = known[2 * half :] & known[half:-half] & known[: -2 * half]
    v[~sure] = 0.0
    for step in range(_STEPS):
        above, below = 0.0, 0.0
        for k in _multiples(int((len(x) - 1) / period), step):
            lag = round(k * period)
            slope = v[:-lag] * known[lag:, None]
            energy = float(np.vdot(slope, slope))
            if energy > 0.0:
                late = float(np.vdot(slope, x[lag:] - x[:-lag])) / energy
                above += energy * k * (lag - late)
                below += energy * k * k
        if below == 0.0:
            break
        period = above / below
    return period
