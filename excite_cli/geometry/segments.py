"""Nearest points of many pairs of segments at once.

For segments p0 + s a and q0 + t b, s and t in [0, 1], with w = p0 - q0, the squared distance is
    |w|^2 + 2 s a.w - 2 t b.w + s^2 a.a - 2 s t a.b + t^2 b.b.
The free minimum in s is clipped, t follows from it, is clipped, and s follows once more: exact for
two segments (Ericson, Real-Time Collision Detection, 5.1.9). Parallel segments, and segments that
are points, start from the middle of what is level with each other, so that the witness does not
jump from end to end.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_POINT = 1e-18  # squared length [m^2] below which a segment is a point
_PARALLEL = 1e-12  # squared sine of the angle below which segments are parallel


class Nearest(NamedTuple):
    """Shares s, t (...) along the segments, and the gap (3, ...) from the first to the second."""

    share_first: Array
    share_second: Array
    gap: Array


def nearest_points(first: Array, along_first: Array, second: Array, along_second: Array) -> Nearest:
    """Nearest points of segments first + s along_first and second + t along_second.

    All arguments are (3, ...): a point and the vector to the other end [m].
    """
    between = first - second
    aa, bb = _dot(along_first, along_first), _dot(along_second, along_second)
    ab = _dot(along_first, along_second)
    aw, bw = _dot(along_first, between), _dot(along_second, between)
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
    return Nearest(s, t, t * along_second - s * along_first - between)


def _level(aa: Array, safe_aa: Array, ab: Array, aw: Array) -> Array:
    """Middle of the part of the first segment that is level with the parallel second one."""
    ends = np.stack([-aw / safe_aa, (ab - aw) / safe_aa])
    low, high = np.clip(ends.min(axis=0), 0.0, 1.0), np.clip(ends.max(axis=0), 0.0, 1.0)
    return np.where(aa > _POINT, (low + high) / 2, 0.0)


def _dot(left: Array, right: Array) -> Array:
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def normals(nearest: Nearest, along_first: Array, along_second: Array) -> Array:
    """Unit normals (3, K) from the first segment to the second.

    Where segments cross the gap has no direction; the common perpendicular is taken (any one
    at right angles if they are parallel): parting along it is the shortest way out.
    """
    gap = nearest.gap
    length = np.sqrt(_dot(gap, gap))
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
