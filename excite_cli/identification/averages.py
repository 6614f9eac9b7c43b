"""Gaussian averages around equidistant instants: the one filter that torque and columns share.

An average is a linear functional of a column, so the linear model holds for averages exactly. Where
some samples of a joint must not count (it sticks, it reverses, they are invalid), its averages
leave them out: weights are set to zero and the others scaled up, for torque and columns alike.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity

from excite_cli.identification.processing import GAUSSIAN, GAUSSIAN_REACH
from excite_cli.measurement.dataset import Array

# An average that keeps less than this share of its weight says nothing.
LEAST_WEIGHT = 0.3


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
    columns = centers.astype(kind)[:, None] + offsets.astype(kind)
    inside = (columns >= 0) & (columns < samples)
    starts = np.concatenate([[0], np.cumsum(inside.sum(axis=1))]).astype(kind)
    values = np.broadcast_to(kernel, inside.shape)[inside]
    return csr_matrix((values, columns[inside], starts), (len(centers), samples))


def without(averages: csr_matrix, counted: NDArray[np.bool_]) -> csr_matrix:
    """Averages over the `counted` samples (T,) only; rows with too little weight become zero."""
    if counted.all():
        return averages
    masked = averages.copy()
    masked.data = masked.data * counted[masked.indices]
    weight = np.asarray(masked.sum(axis=1)).ravel()
    scale = np.where(weight >= LEAST_WEIGHT, 1.0 / np.maximum(weight, LEAST_WEIGHT), 0.0)
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
