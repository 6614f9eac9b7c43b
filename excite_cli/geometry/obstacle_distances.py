"""Distances of capsules from obstacles that stand still, along a motion, and their derivatives.

The distance is that of the capsule's axis less its radius. With n the unit normal of the obstacle
and p the witness point on the axis, dd/dq_k = n·(v_k + ω_k × p) for every joint k that carries the
capsule, (v_k, ω_k) its twist about the world origin.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.forward_kinematics import States
from excite_cli.geometry.obstacles import Box, Obstacle
from excite_cli.geometry.world_segments import CapsuleAxes, WorldSegments
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import carried_bodies
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_BLOCK = 4000


class ObstacleDistances:
    """Signed distances of pairs (capsule, obstacle), by their indices, for arrays of positions."""

    def __init__(
        self,
        robot: Robot,
        capsules: Sequence[Capsule],
        obstacles: Sequence[Obstacle],
        pairs: Sequence[tuple[int, int]],
    ) -> None:
        self._robot = robot
        checked = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        used, self._capsule = np.unique(checked[:, 0], return_inverse=True)
        self._thing = checked[:, 1]
        kept = [capsules[index] for index in used]
        self._axes = CapsuleAxes(robot, kept)
        radius = np.array([capsule.radius for capsule in kept])
        self._radii = radius[self._capsule]
        ball = radius + 0.5 * np.linalg.norm(self._axes.along, axis=1)
        self._balls = ball[self._capsule]
        self._carried = carried_bodies(robot)[self._axes.joints][self._capsule]  # (P, m)
        self._groups = [
            (obstacle, np.flatnonzero(self._thing == index))
            for index, obstacle in enumerate(obstacles)
        ]

    @property
    def n_pairs(self) -> int:
        """Number of pairs P."""
        return len(self._capsule)

    def distances(self, q: Array | States, exact_below: float = np.inf) -> Array:
        """Signed distances (T, P) [m] at moved-joint positions q (T, n), or at states.

        Where a ball around the capsule already shows the distance from a box to be at least
        `exact_below`, that bound is returned instead.
        """
        world = self._axes.in_world(q)
        result = np.empty((self.n_pairs, world.start.shape[2]))
        for obstacle, columns in self._groups:
            if isinstance(obstacle, Box) and np.isfinite(exact_below):
                result[columns] = self._where_near(world, obstacle, columns, exact_below)
                continue
            size = max(1, _BLOCK // max(result.shape[1], 1))
            for k in range(0, len(columns), size):  # blocks that stay in the processor's cache
                some = columns[k : k + size]
                at = self._capsule[some]
                axis = obstacle.distances(world.start[:, at], world.along[:, at])
                result[some] = axis - self._radii[some, None]
        return result.T

    def _where_near(
        self, world: WorldSegments, obstacle: Obstacle, columns: Indices, exact_below: float
    ) -> Array:
        """Distances (K, T) where they may be below the bound, else bounds from balls."""
        capsule = self._capsule[columns]
        start, along = world.start[:, capsule], world.along[:, capsule]
        found = obstacle.point_distances(start + 0.5 * along) - self._balls[columns, None]
        near = np.nonzero(found < exact_below)
        for k in range(0, len(near[0]), _BLOCK):
            one, at = near[0][k : k + _BLOCK], near[1][k : k + _BLOCK]
            axis = obstacle.distances(start[:, one, at], along[:, one, at])
            found[one, at] = axis - self._radii[columns[one]]
        return found

    def gradients(self, q: Array | States, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        world = self._axes.in_world(q)
        normal, point = np.empty((3, len(rows))), np.empty((3, len(rows)))
        things = self._thing[cols]
        for index, (obstacle, _) in enumerate(self._groups):
            some = np.flatnonzero(things == index)
            if not len(some):
                continue
            place = (slice(None), self._capsule[cols[some]], rows[some])
            start, along = world.start[place], world.along[place]
            contact = obstacle.contacts(start, along)
            normal[:, some], point[:, some] = contact.normal, start + contact.share * along
        wrench = np.hstack([normal.T, np.cross(point.T, normal.T)])
        twists = world.columns()[rows][:, self._robot.tree.moved]  # (K, m, 6)
        return self._robot.gathered(self._carried[cols] * (twists @ wrench[..., None])[..., 0])
