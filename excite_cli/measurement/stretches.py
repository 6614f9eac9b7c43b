"""Stretches of samples for which something holds."""

import numpy as np
from numpy.typing import NDArray

from excite_cli.measurement.dataset import Mask


def stretches(mask: Mask) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First places and lengths of the stretches of true in `mask` (T,)."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    first = np.flatnonzero(edges == 1)
    return first, np.flatnonzero(edges == -1) - first


def longest(mask: Mask) -> int:
    """Length of the longest stretch of true."""
    lengths = stretches(mask)[1]
    return int(lengths.max()) if len(lengths) else 0
