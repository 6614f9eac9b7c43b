"""Repeated periods of a motion: their length, from the positions alone."""

import numpy as np

from excite_cli.identification.exact_period import exact_period
from excite_cli.robot.model import Array


def period_of(q: Array) -> int | None:
    """Samples per period of q (T, n) if at least two whole periods are there, else None."""
    found = exact_period(q, np.ones(len(q), dtype=bool))
    return None if found is None else round(found)


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
