"""Lower bounds on distances between capsules that hold over whole intervals of time.

Two convex shapes are at least as far apart as along any direction n: with the ends e of two axes,

    d ≥ min over ends of n·(e₂ − e₁) / |n| − r₁ − r₂.

n may change with time in any known way and the bound still holds; it is tight if n follows the true
normal. Here n(s) = n₀ + n₁ s, n₀ the normal in the middle of the interval and n₁ estimated from the
normals before and after, so that the bound is off by second order only. Pairs that stay apart even
if both shapes moved towards each other as far as they can are not looked at that closely.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.arrays import Indices
from excite_cli.geometry.obstacles import Box, Obstacle, Plane
from excite_cli.geometry.world_segments import nearest_points, normals
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.taylor import Array, Taylor, dot
from excite_cli.robot.capsule import Capsule

BESIDE = 0.7  # where in the interval the normals are compared


class EnclosedCapsules:
    """Axes of C capsules over T intervals: `ends` encloses (T, C, 2, 3) [m]."""

    def __init__(self, capsules: Sequence[Capsule], motion: EnclosedMotion) -> None:
        count = len(capsules)
        terms = np.zeros((3, motion.count, count, 2, 3))
        radius = np.zeros((motion.count, count, 2, 3))
        by_joint: dict[int, list[int]] = {}
        for index, capsule in enumerate(capsules):
            by_joint.setdefault(capsule.joint, []).append(index)
        for joint, members in by_joint.items():
            local = np.array([[capsules[i].start, capsules[i].end] for i in members])
            points = motion.points(joint, local.reshape(-1, 3))
            shape = (motion.count, len(members), 2, 3)
            terms[:, :, members] = points.terms.reshape(3, *shape)
            radius[:, members] = points.radius.reshape(shape)
        self.ends = Taylor(terms, radius)
        self.radii = np.array([capsule.radius for capsule in capsules])
        # An axis moves no farther than one of its ends.
        self.reach = np.sqrt((self.ends.reach**2).sum(axis=-1)).max(axis=-1)

    def least_distances(self, first: Indices, second: Indices, enough: float) -> Array:
        """Lower bounds (T, P) on the signed distances [m] of pairs of capsules.

        Bounds above `enough` may be less tight than they could be.
        """
        apart = _apart(self.ends.center, first, second) - self.radii[first] - self.radii[second]
        apart -= self.reach[:, first] + self.reach[:, second]
        rows, columns = np.nonzero(apart < enough)
        if len(rows):
            one, other = self.ends[rows, first[columns]], self.ends[rows, second[columns]]
            separated = _separated(one, other)
            separated -= self.radii[first[columns]] + self.radii[second[columns]]
            apart[rows, columns] = np.maximum(apart[rows, columns], separated)
        return apart


def _apart(ends: Array, first: Indices, second: Indices) -> Array:
    """Distances (T, P) of the axes in the middle of the intervals; ends (T, C, 2, 3)."""
    start = np.moveaxis(ends[:, :, 0], -1, 0)
    along = np.moveaxis(ends[:, :, 1] - ends[:, :, 0], -1, 0)
    nearest = nearest_points(start[:, :, first], along[:, :, first],
                             start[:, :, second], along[:, :, second])  # fmt: skip
    return np.asarray(np.sqrt((nearest.gap**2).sum(axis=0)))


def _separated(one: Taylor, other: Taylor) -> Array:
    """Lower bounds (K,) on the distance of two axes with ends (K, 2, 3)."""
    normal = turning_normal(*(_normals(one.at(s), other.at(s)) for s in (-BESIDE, 0.0, BESIDE)))
    return along_direction(one, other, normal)


def turning_normal(before: Array, middle: Array, after: Array) -> Taylor:
    """n(s) = n₀ + n₁ s (K, 3) from unit normals before, in, and after the middle."""
    terms = np.zeros((3, *middle.shape))
    terms[0], terms[1] = middle, (after - before) / (2 * BESIDE)
    # A normal that jumps is no guide.
    terms[1, np.linalg.norm(terms[1], axis=-1) > 0.5] = 0.0
    return Taylor(terms, np.zeros(middle.shape))


def along_direction(one: Taylor, other: Taylor, normal: Taylor) -> Array:
    """Lower bounds (K,) on the distance of point sets with extremes (K, E, 3), (K, F, 3).

    `normal` (K, 3), without radius, points from the first to the second.
    """
    gaps = []
    for i in range(one.shape[1]):
        for j in range(other.shape[1]):
            gaps.append(dot(normal, other[:, j] - one[:, i]).lower())
    least = np.min(gaps, axis=0)
    return np.asarray(least / np.where(least > 0, longest(normal), shortest(normal)))


def longest(normal: Taylor) -> Array:
    """The largest |n| over the interval: at one of its ends, |n|² being convex."""
    ends = [np.linalg.norm(normal.at(s), axis=-1) for s in (-1.0, 1.0)]
    return np.asarray(np.maximum(*ends))


def shortest(normal: Taylor) -> Array:
    """A lower bound on |n|; n does not turn by more than half."""
    size = np.linalg.norm(normal.terms[0], axis=-1) - np.linalg.norm(normal.terms[1], axis=-1)
    return np.maximum(size, 1e-6)


def _normals(one: Array, other: Array) -> Array:
    """Unit normals (K, 3) from one axis to the other; ends (K, 2, 3)."""
    start, along = one[:, 0].T, (one[:, 1] - one[:, 0]).T
    begin, way = other[:, 0].T, (other[:, 1] - other[:, 0]).T
    return normals(nearest_points(start, along, begin, way), along, way).T


# Lower bounds on distances between capsules and obstacles, over whole intervals of time.
#
# As for two capsules (`proof.enclosed_distances`): along any direction n(s) = n₀ + n₁ s from the
# obstacle to the capsule, with e the ends of its axis and h(n) the support of the obstacle,
#
#     d ≥ min over ends of (n·e − h(n)) / |n| − r,
#
# h(n) = offset for a half-space with its own normal, and n·c + Σ_k half_k |n·axis_k| for a box.
# Each |n·axis_k| is convex in s and so lies below its chord.


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
        close = _separated_from(ends[rows, columns], obstacle) - radii[columns]
        apart[rows, columns] = np.maximum(apart[rows, columns], close)
    return np.asarray(apart)


def _separated_from(ends: Taylor, obstacle: Obstacle) -> Array:
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
