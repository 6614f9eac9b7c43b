"""Lower bounds on distances between capsules and obstacles, over whole intervals of time.

As for two capsules (`proof.enclosed_distances`): along any direction n(s) = n₀ + n₁ s from the
obstacle to the capsule, with e the ends of its axis and h(n) the support of the obstacle,

    d ≥ min over ends of (n·e − h(n)) / |n| − r,

h(n) = offset for a half-space with its own normal, and n·c + Σ_k half_k |n·axis_k| for a box. Each
|n·axis_k| is convex in s and so lies below its chord.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.obstacles import Box, Obstacle, Plane
from excite_cli.proof.enclosed_distances import (
    BESIDE,
    EnclosedCapsules,
    longest,
    shortest,
    turning_normal,
)
from excite_cli.proof.taylor import Array, Taylor, dot

Indices = NDArray[np.intp]


def least_clearances(
    axes: EnclosedCapsules, obstacle: Obstacle, capsules: Indices, enough: float
) -> Array:
    """Lower bounds (T, K) on the signed distances [m] of K capsules from one obstacle.

    Bounds above `enough` may be less tight than they could be.
    """
    radii = axes.radii[capsules]
    ends = axes.ends[:, capsules]
    start, along = _segments(ends.center)
    apart = obstacle.distances(start, along) - radii - axes.reach[:, capsules]
    rows, columns = np.nonzero(apart < enough)
    if len(rows):
        close = _separated(ends[rows, columns], obstacle) - radii[columns]
        apart[rows, columns] = np.maximum(apart[rows, columns], close)
    return np.asarray(apart)


def _separated(ends: Taylor, obstacle: Obstacle) -> Array:
    """Lower bounds (K,) on the distance of axes with ends (K, 2, 3) from an obstacle."""
    if isinstance(obstacle, Plane):
        along = ends.through(obstacle.normal[None])[..., 0]
        return np.asarray(along.lower().min(axis=1) - obstacle.offset)
    assert isinstance(obstacle, Box)
    normal = turning_normal(
        *(obstacle.contacts(*_segments(ends.at(s))).normal.T for s in (-BESIDE, 0.0, BESIDE))
    )
    from_center = ends - obstacle.position
    gaps: Sequence[Taylor] = [dot(normal, from_center[:, end]) for end in range(2)]
    support = _support(normal, obstacle)
    least = np.min([(gap - support).lower() for gap in gaps], axis=0)
    return np.asarray(least / np.where(least > 0, longest(normal), shortest(normal)))


def _support(normal: Taylor, box: Box) -> Taylor:
    """Upper bound (K,) on Σ half_k |n·axis_k|: chords between both ends of the interval."""
    before, after = (np.abs(normal.at(s) @ box.rotation) @ box.half for s in (-1.0, 1.0))
    terms = np.stack([(before + after) / 2, (after - before) / 2, np.zeros_like(before)])
    return Taylor(terms, np.zeros_like(before))


def _segments(ends: Array) -> tuple[Array, Array]:
    """Starts and ways to the other end (3, ...) of axes (..., 2, 3)."""
    start = np.moveaxis(ends[..., 0, :], -1, 0)
    return start, np.moveaxis(ends[..., 1, :], -1, 0) - start
