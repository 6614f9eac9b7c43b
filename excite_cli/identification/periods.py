"""Repeated periods of a motion: their length, from the positions alone."""

import numpy as np

from excite_cli.robot.model import Array

# Positions one period apart differ by less than this share of their range.
_ALIKE = 0.02


def period_of(q: Array) -> int | None:
    """Samples per period of q (T, n) if at least two whole periods are there, else None."""
    centered = q - q.mean(axis=0)
    spread = centered.std(axis=0)
    moved = spread > 1e-6
    if not moved.any() or len(q) < 16:
        return None
    x = centered[:, moved] / spread[moved]
    size = len(x)
    padded = np.fft.rfft(x, 2 * size, axis=0)
    products = np.fft.irfft(np.abs(padded) ** 2, axis=0)[:size].sum(axis=1)
    squares = np.concatenate([[0.0], np.cumsum(np.square(x).sum(axis=1))])
    lags = np.arange(size // 2 + 1)
    head, tail = squares[size - lags], squares[size] - squares[lags]
    # Mean squared difference of samples one lag apart, 2 for unrelated ones.
    apart = (head + tail - 2 * products[: len(lags)]) / (size - lags) / x.shape[1]
    far = np.flatnonzero(apart > 0.5)
    if not len(far):
        return None
    first = int(far[0])
    good = np.flatnonzero(apart[first:] < _ALIKE**2)
    if not len(good):
        return None
    start = first + int(good[0])
    rising = np.flatnonzero(np.diff(apart[start:]) > 0)
    return start + (int(rising[0]) if len(rising) else 0)


def mean_of_other_periods(x: Array, period: int) -> Array:
    """For every sample of x (T, …) the mean of the samples whole periods away from it."""
    count = len(x)
    total = np.zeros_like(x)
    seen = np.zeros(count)
    for shift in range(period, count, period):
        total[shift:] += x[:-shift]
        total[:-shift] += x[shift:]
        seen[shift:] += 1
        seen[:-shift] += 1
    return total / np.maximum(seen, 1.0).reshape(-1, *([1] * (x.ndim - 1)))
