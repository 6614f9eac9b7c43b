"""Distances between capsules along a motion, and their derivatives by the joint positions.

The distance of two capsules is that of their segments less both radii, negative inside and
continuous through contact. With n the unit vector between the witness points p1 and p2,
    dd/dq = n . (J_2 - J_1)
and, because n is parallel to p2 - p1, both velocities may be taken at either point: a joint that
carries both bodies drops out, one that carries only the second adds n . (v + w x p) for its twist
(v, w) about the world origin, one that carries only the first subtracts it.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.geometry.world_segments import (
    CapsuleAxes,
    NearestPoints,
    WorldSegments,
    nearest_points,
    normals,
)
from excite_cli.kernels.compiled import KERNELS
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import carried_bodies
from excite_cli.robot.model import Robot

_BLOCK = 8000


class PairDistances:
    """Signed distances of pairs of capsules, for whole arrays of positions.

    The placements of the last positions are kept, so `gradients` after `distances` at the same
    positions does not compute them again.
    """

    def __init__(
        self, robot: Robot, capsules: Sequence[Capsule], pairs: Sequence[tuple[int, int]]
    ) -> None:
        self._robot = robot
        checked = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        used, place = np.unique(checked, return_inverse=True)
        self._first, self._second = np.ascontiguousarray(place.reshape(-1, 2).T)
        kept = [capsules[index] for index in used]
        self._axes = CapsuleAxes(robot, kept)
        radius = np.array([capsule.radius for capsule in kept], dtype=float)
        self._radii = radius[self._first] + radius[self._second]
        ball = radius + 0.5 * np.linalg.norm(self._axes.along, axis=1)
        self._balls = ball[self._first] + ball[self._second]
        carried = carried_bodies(robot)[self._axes.joints]  # (C, m)
        self._sign = carried[self._second] - carried[self._first]
        self._moved = np.array(robot.tree.moved, dtype=np.int64)

    @property
    def n_pairs(self) -> int:
        """Number of pairs P."""
        return len(self._first)

    def distances(self, q: Array | States, exact_below: float = np.inf) -> Array:
        """Signed distances (T, P) [m] at moved-joint positions q (T, n), or at states.

        Where a ball around each segment already shows the distance to be at least `exact_below`,
        that bound is returned instead, which saves most of the work for robots of many links.
        """
        world = self._axes.in_world(q)
        if KERNELS is not None:
            return self._compiled_distances(world, float(exact_below))
        if np.isfinite(exact_below):
            bounds = self._bounds(world)
            cols, rows = np.nonzero(bounds < exact_below)
            for k in range(0, len(cols), _BLOCK):
                some = slice(k, k + _BLOCK)
                gap = self._nearest_at(world, rows[some], cols[some])[0].gap
                bounds[cols[some], rows[some]] = _length(gap) - self._radii[cols[some]]
            return bounds.T
        result = np.empty((self.n_pairs, world.start.shape[2]))
        size = max(1, _BLOCK // max(result.shape[1], 1))
        for k in range(0, self.n_pairs, size):  # blocks that stay in the processor's cache
            first, second = self._first[k : k + size], self._second[k : k + size]
            gap = nearest_points(
                world.start[:, first],
                world.along[:, first],
                world.start[:, second],
                world.along[:, second],
            ).gap
            result[k : k + size] = _length(gap)
        result -= self._radii[:, None]
        return result.T

    def _compiled_distances(self, world: WorldSegments, exact_below: float) -> Array:
        assert KERNELS is not None
        axes, (rotations, translations) = self._axes, world.placements
        found = np.empty((len(rotations), self.n_pairs))
        KERNELS.call(
            "distances", axes.joints, axes.start, axes.along, self._first, self._second,
            self._radii, self._balls, exact_below, rotations, translations, found,
        )  # fmt: skip
        return found

    def _bounds(self, world: WorldSegments) -> Array:
        """Lower bounds (P, T) of the distances, from balls around the segments."""
        middle = world.start + 0.5 * world.along
        apart = _length(middle[:, self._first] - middle[:, self._second])
        return apart - self._balls[:, None]

    def distances_at(self, q: Array, rows: Indices, cols: Indices) -> Array:
        """Signed distances (K,) [m] at instant rows[k] of pair cols[k] only."""
        world = self._axes.in_world(q)
        return _length(self._nearest_at(world, rows, cols)[0].gap) - self._radii[cols]

    def gradients(self, q: Array | States, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        world = self._axes.in_world(q)
        by_passes = self._gradients if KERNELS is None else self._compiled_gradients
        return self._robot.gathered(by_passes(world, rows, cols))

    def _compiled_gradients(self, world: WorldSegments, rows: Indices, cols: Indices) -> Array:
        assert KERNELS is not None
        axes, (rotations, translations) = self._axes, world.placements
        columns = np.ascontiguousarray(world.columns())
        found = np.empty((len(rows), len(self._moved)))
        KERNELS.call(
            "gradients", axes.joints, axes.start, axes.along, self._first, self._second,
            self._sign, self._moved, rotations, translations, columns,
            np.ascontiguousarray(rows, dtype=np.int64), np.ascontiguousarray(cols, dtype=np.int64),
            found,
        )  # fmt: skip
        crossed = np.flatnonzero(np.isnan(found[:, 0]))
        if len(crossed):
            found[crossed] = self._gradients(world, rows[crossed], cols[crossed])
        return found

    def _gradients(self, world: WorldSegments, rows: Indices, cols: Indices) -> Array:
        """`gradients` in NumPy; it alone knows what to do where segments cross."""
        nearest, start, along, along_second = self._nearest_at(world, rows, cols)
        normal = normals(nearest, along, along_second).T
        point = (start + nearest.share_first * along + 0.5 * nearest.gap).T
        wrench = np.hstack([normal, np.cross(point, normal)])
        twists = world.columns()[rows][:, self._moved]  # (K, m, 6)
        return self._sign[cols] * (twists @ wrench[..., None])[..., 0]

    def _nearest_at(
        self, world: WorldSegments, rows: Indices, cols: Indices
    ) -> tuple[NearestPoints, Array, Array, Array]:
        first, second = self._first[cols], self._second[cols]
        start, along = world.start[:, first, rows], world.along[:, first, rows]
        along_second = world.along[:, second, rows]
        nearest = nearest_points(start, along, world.start[:, second, rows], along_second)
        return nearest, start, along, along_second


def _length(gap: Array) -> Array:
    return np.sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2])
