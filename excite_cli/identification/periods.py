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
    whole = -(-count // period)
    padded = np.zeros((whole * period, *x.shape[1:]))
    padded[:count] = x
    seen = np.zeros(whole * period)
    seen[:count] = 1.0
    total = padded.reshape(whole, period, *x.shape[1:]).sum(axis=0)
    others = seen.reshape(whole, period).sum(axis=0) - 1.0
    phase = np.arange(count) % period
    weights = np.maximum(others, 1.0).reshape(-1, *([1] * (x.ndim - 1)))
    return np.asarray((total[phase] - x) / weights[phase])
