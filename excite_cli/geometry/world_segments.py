"""Axes of capsules in the world at many instants, with the motion columns that move them."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class WorldSegments:
    """Axes of C capsules at T instants: `start` and `along` (3, C, T) [m]."""

    def __init__(self, placements: tuple[Array, Array], axes: "CapsuleAxes") -> None:
        self.placements, self._axes = placements, axes
        self._columns: Array | None = None
        self._states: States | None = None

    @property
    def start(self) -> Array:
        """Where the axes start (3, C, T) [m]."""
        return self._ends[0]

    @property
    def along(self) -> Array:
        """From their starts to their other ends (3, C, T) [m]."""
        return self._ends[1]

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        rotations, translations = self.placements
        joints, start, along = self._axes.joints, self._axes.start, self._axes.along
        starts = np.empty((3, len(joints), len(rotations)))
        alongs = np.empty_like(starts)
        still = joints == 0
        starts[:, still] = start[still].T[:, :, None]
        alongs[:, still] = along[still].T[:, :, None]
        moving = ~still
        turn = rotations.swapaxes(0, 1)[joints[moving] - 1]  # (C, T, 3, 3)
        shift = translations.swapaxes(0, 1)[joints[moving] - 1]
        local = np.stack([start[moving], along[moving]], axis=-1)[:, None]
        both = turn @ local  # (C, T, 3, 2)
        starts[:, moving] = np.moveaxis(both[..., 0] + shift, -1, 0)
        alongs[:, moving] = np.moveaxis(both[..., 1], -1, 0)
        return starts, alongs

    def share_columns(self, states: States) -> None:
        """Take the Jacobian columns from `states`, which computes them once for all."""
        self._states = states

    def columns(self) -> Array:
        """Jacobian columns (T, nv, 6), [linear; angular] about the world origin."""
        if self._states is not None:
            return self._states.columns
        if self._columns is None:
            self._columns = self._axes.kinematics.axes(*self.placements)
        return self._columns


class CapsuleAxes:
    """Axes of `capsules` of `robot` in the frames of their `joints` (C,).

    What the last positions gave is kept, so that derivatives after distances do not compute it
    again.
    """

    def __init__(self, robot: Robot, capsules: Sequence[Capsule]) -> None:
        self._n = robot.n
        self.kinematics = BatchKinematics(robot)
        self.joints = np.array([capsule.joint for capsule in capsules], dtype=np.int64)
        self.start = np.array([capsule.start for capsule in capsules], dtype=float).reshape(-1, 3)
        self.along = np.array([c.end - c.start for c in capsules], dtype=float).reshape(-1, 3)
        self._last: tuple[Array, WorldSegments] | None = None

    def in_world(self, q: Array | States) -> WorldSegments:
        """At moved-joint positions q (T, n), or at states."""
        if isinstance(q, States):
            if self._last is None or self._last[0] is not q.q:
                world = WorldSegments(q.placements, self)
                world.share_columns(q)
                self._last = (q.q, world)
            return self._last[1]
        q = np.asarray(q, dtype=float).reshape(-1, self._n)
        if self._last is not None and np.array_equal(self._last[0], q):
            return self._last[1]
        world = WorldSegments(self.kinematics.placements(q), self)
        self._last = (q.copy(), world)
        return world
