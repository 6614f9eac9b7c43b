"""Stretches of samples for which something holds, and whether a joint moves around one."""

import numpy as np
from numpy.typing import NDArray

from excite_cli.measurement.dataset import Array, Mask


def stretches(mask: Mask) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First places and lengths of the stretches of true in `mask` (T,)."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    first = np.flatnonzero(edges == 1)
    return first, np.flatnonzero(edges == -1) - first


def longest(mask: Mask) -> int:
    """Length of the longest stretch of true."""
    lengths = stretches(mask)[1]
    return int(lengths.max()) if len(lengths) else 0


# A joint really moves, or its encoder only flickers or has noise.

_AROUND = 100  # samples to either side
# Median steps that a window of noise never is wide (5 to 8, as 200 normal numbers come out); and
# the correlation of neighbouring steps, which is -0.5 in noise and not above 0 in a flicker.
_WIDE, _ALIKE = 12.0, 0.5


def moves(q: Array, start: int, end: int) -> Mask:
    """Which joints (n,) of positions (T, n) move somewhere near the samples from start to end.

    Their steps add up to a way, or each is much like the one before.
    """
    near = q[max(0, start - _AROUND) : end + _AROUND]
    steps = np.diff(near, axis=0)
    if not len(steps):
        return np.zeros(q.shape[1], dtype=bool)
    width = np.ptp(near, axis=0)
    size = np.abs(steps)
    # Steps of zero are none: a coarse encoder of a slow joint has many.
    usual = np.array([np.median(own[own > 0]) if own.any() else np.inf for own in size.T])
    alike = (steps[1:] * steps[:-1]).sum(axis=0) > _ALIKE * np.square(steps).sum(axis=0)
    return np.asarray((width > _WIDE * usual) | (alike & (width > 0)))
