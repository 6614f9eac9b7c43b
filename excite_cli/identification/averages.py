"""Gaussian averages around equidistant instants: the one filter that torque and columns share.

An average is a linear functional of a column, so the linear model holds for averages exactly. Where
some samples of a joint must not count (it sticks, it reverses, they are invalid), its averages
leave them out: weights are set to zero and the others scaled up, for torque and columns alike.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, hstack, identity

from excite_cli.identification.processing import GAUSSIAN, GAUSSIAN_REACH
from excite_cli.measurement.dataset import Array

# An average that keeps less than this share of its weight says nothing.
_LEAST_WEIGHT = 0.3
_MATTERS = 0.01  # RMS of the rounding, as a share of the torque's standard deviation
_QUARTERS = 4


def reach(h: float, cutoff: float | None) -> int:
    """Half width of the average in samples of length h [s]; `cutoff` in Hz."""
    return 0 if cutoff is None else max(1, int(np.ceil(GAUSSIAN_REACH * GAUSSIAN / cutoff / h)))


def average_rows(
    samples: int, centers: NDArray[np.intp], h: float, cutoff: float | None
) -> csr_matrix:
    """Averages (M, samples) around `centers` (M,) of samples h apart."""
    half = reach(h, cutoff)
    offsets = np.arange(-half, half + 1)
    width = GAUSSIAN / cutoff / h if cutoff else 1.0
    kernel = np.exp(-0.5 * (offsets / width) ** 2)
    kernel /= kernel.sum()
    # Indices of 32 bits where they do: those of long runs fill memory.
    kind = np.int32 if len(centers) * len(kernel) < 2**31 else np.int64
    columns = (centers.astype(kind)[:, None] + offsets.astype(kind)).ravel()
    values, counts = np.tile(kernel, len(centers)), np.full(len(centers), len(kernel))
    if centers.min(initial=half) < half or centers.max(initial=0) + half >= samples:
        inside = (columns >= 0) & (columns < samples)
        counts = inside.reshape(-1, len(kernel)).sum(axis=1)
        values, columns = values[inside], columns[inside]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(kind)
    return csr_matrix((values, columns, starts), (len(centers), samples))


def without(averages: csr_matrix, counted: NDArray[np.bool_]) -> csr_matrix:
    """Averages over the `counted` samples (T,) only; rows with too little weight become zero."""
    if counted.all():
        return averages
    masked = averages.copy()
    masked.data = masked.data * counted[masked.indices]
    weight = np.asarray(masked.sum(axis=1)).ravel()
    scale = np.where(weight >= _LEAST_WEIGHT, 1.0 / np.maximum(weight, _LEAST_WEIGHT), 0.0)
    masked.data *= np.repeat(scale, np.diff(masked.indptr))
    return masked


def interpolation(samples: int, stride: int, fine: int) -> csr_matrix:
    """Values (fine,) between `samples` values that are `stride` apart, by cubic polynomials.

    Samples beyond the last value are left out (zero rows). Needs four values.
    """
    if stride == 1:
        return csr_matrix(identity(samples, format="csr")[:fine])
    at = np.arange(min(fine, (samples - 1) * stride + 1))
    first = np.clip(at // stride - 1, 0, samples - 4)
    weights = cubic_weights(at / stride - first)
    columns = first[:, None] + np.arange(4)
    rows = np.repeat(at, 4)
    return csr_matrix((weights.ravel(), (rows, columns.ravel())), (fine, samples))


def cubic_weights(u: Array) -> Array:
    """Weights (M, 4) of the values at 0, 1, 2, 3 in that of their cubic polynomial at u (M,)."""
    return np.stack(
        [
            -(u - 1) * (u - 2) * (u - 3) / 6,
            u * (u - 2) * (u - 3) / 2,
            -u * (u - 1) * (u - 3) / 2,
            u * (u - 1) * (u - 2) / 6,
        ],
        axis=1,
    )


def filled(averages: csr_matrix) -> NDArray[np.bool_]:
    """Which averages (M,) have weight."""
    return np.asarray(abs(averages).sum(axis=1)).ravel() > 0.5


def apply(averages: csr_matrix, columns: Array) -> Array:
    """A x along the first axis of (T, …)."""
    flat = columns.reshape(len(columns), int(np.prod(columns.shape[1:])))
    return np.asarray(averages @ flat).reshape(averages.shape[0], *columns.shape[1:])


def rounding_of(averages: csr_matrix, tau: Array, step: float) -> csr_matrix | None:
    """Q (M, K): the error of averaged torques is Q z, with z of unit variance; None if negligible.

    A torque `tau` (T,) [N·m] that is recorded in steps of s is wrong by what is uniform within
    ± s/2, with variance s²/12. It is no noise: a motion that brings the torque to the same step
    again brings the same error, and while the torque stays there the error changes slowly. So it is
    taken for two numbers of that variance, one for every step and one for every quarter of the
    stays on it: errors that neither averages nor repetition take out. (With half of the variance
    for each, sizes fitted to rounded torques of few steps missed the truth by 1.9 of their standard
    deviations.)
    """
    size = step / np.sqrt(12.0)
    if not size > _MATTERS * np.std(tau):
        return None
    level = np.round((tau - tau.min()) / step).astype(np.intp)
    edges = np.flatnonzero(np.diff(level)) + 1
    starts, ends = np.append(0, edges), np.append(edges, len(tau))
    place = np.arange(len(tau)) - np.repeat(starts, ends - starts)
    quarter = _QUARTERS * place // np.repeat(ends - starts, ends - starts)
    shared = _indicator(level)
    own = _indicator(_QUARTERS * level + quarter)
    return (averages @ (size * hstack([shared, own]))).tocsr()


def _indicator(number: Array) -> csr_matrix:
    """1 (T, K) in the column of every sample's number."""
    ones = np.ones(len(number))
    return csr_matrix((ones, (np.arange(len(number)), number)))
