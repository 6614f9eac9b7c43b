"""Axes of capsules in the world at many instants, with the motion columns that move them."""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Array, Robot

# Nearest points of many pairs of segments at once.
#
# For segments p0 + s a and q0 + t b, s and t in [0, 1], with w = p0 - q0, the squared distance is
#     |w|^2 + 2 s a.w - 2 t b.w + s^2 a.a - 2 s t a.b + t^2 b.b.
# The free minimum in s is clipped, t follows from it, is clipped, and s follows once more: exact
# for two segments (Ericson, Real-Time Collision Detection, 5.1.9). Parallel segments, and segments
# that are points, start from the middle of what is level with each other, so that the witness does
# not jump from end to end.

_POINT = 1e-18  # squared length [m^2] below which a segment is a point
_PARALLEL = 1e-12  # squared sine of the angle below which segments are parallel


class NearestPoints(NamedTuple):
    """Shares s, t (...) along the segments, and the gap (3, ...) from the first to the second."""

    share_first: Array
    share_second: Array
    gap: Array


def nearest_points(
    first: Array, along_first: Array, second: Array, along_second: Array
) -> NearestPoints:
    """Nearest points of segments first + s along_first and second + t along_second.

    All arguments are (3, ...): a point and the vector to the other end [m].
    """
    between = first - second
    aa, bb = dot(along_first, along_first), dot(along_second, along_second)
    ab = dot(along_first, along_second)
    aw, bw = dot(along_first, between), dot(along_second, between)
    safe_aa, safe_bb = np.maximum(aa, _POINT), np.maximum(bb, _POINT)
    determinant = aa * bb - ab * ab
    skew = determinant > _PARALLEL * safe_aa * safe_bb
    s = (ab * bw - bb * aw) / np.where(skew, determinant, 1.0)
    if not skew.all():
        flat = ~skew
        s[flat] = _level(aa[flat], safe_aa[flat], ab[flat], aw[flat])
    np.clip(s, 0.0, 1.0, out=s)
    t = np.clip((s * ab + bw) / safe_bb, 0.0, 1.0)
    s = np.clip((t * ab - aw) / safe_aa, 0.0, 1.0)
    return NearestPoints(s, t, t * along_second - s * along_first - between)


def _level(aa: Array, safe_aa: Array, ab: Array, aw: Array) -> Array:
    """Middle of the part of the first segment that is level with the parallel second one."""
    ends = np.stack([-aw / safe_aa, (ab - aw) / safe_aa])
    low, high = np.clip(ends.min(axis=0), 0.0, 1.0), np.clip(ends.max(axis=0), 0.0, 1.0)
    return np.where(aa > _POINT, (low + high) / 2, 0.0)


def dot(left: Array, right: Array) -> Array:
    """Scalar products (...) of vectors (3, ...)."""
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def normals(nearest: NearestPoints, along_first: Array, along_second: Array) -> Array:
    """Unit normals (3, K) from the first segment to the second.

    Where segments cross the gap has no direction; the common perpendicular is taken (any one
    at right angles if they are parallel): parting along it is the shortest way out.
    """
    gap = nearest.gap
    length = np.sqrt(dot(gap, gap))
    crossed = length < 1e-10
    result = gap / np.where(crossed, 1.0, length)
    for k in np.flatnonzero(crossed):
        result[:, k] = _perpendicular(along_first[:, k], along_second[:, k])
    return result


def _perpendicular(first: Array, second: Array) -> Array:
    candidates = [np.cross(first, second)]
    longer = first if first @ first >= second @ second else second
    candidates.append(np.cross(longer, np.eye(3)[int(np.argmin(np.abs(longer)))]))
    scales = (np.sqrt(first @ first) * np.sqrt(second @ second), np.sqrt(longer @ longer))
    for vector, scale in zip(candidates, scales, strict=True):
        size = float(np.linalg.norm(vector))
        if size > 1e-6 * scale and size > 1e-18:
            return vector / size
    return np.array([0.0, 0.0, 1.0])


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
