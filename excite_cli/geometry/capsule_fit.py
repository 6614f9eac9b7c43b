"""The smallest capsule around a cloud of points.

A capsule is all points within `radius` of the segment start-end; V = pi r^2 L + 4/3 pi r^3. The fit

    min V(start, end, r)   such that   |x_i - segment| <= r   for every point x_i

is smooth in (start, end, r) except where a witness changes, and not convex. It is therefore
started from the best few of many axis directions, refined by SLSQP on the few points that can
touch the capsule, and *repaired*: for a line and a radius that reaches every point, the shortest
segment is known exactly. With z_i along the line and rho_i beside it, the caps need

    start <= min_i (z_i + sqrt(r^2 - rho_i^2)),    end >= max_i (z_i - sqrt(r^2 - rho_i^2)).
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from excite_cli.arrays import Array

_SLACK = 1e-12  # relative to the size of the cloud
_DIRECTIONS = 120
_FEW_DIRECTIONS = 40
_REFINED_STARTS = 3


def capsule_volume(start: Array, end: Array, radius: float) -> float:
    """Volume [m^3] of a capsule."""
    length = float(np.linalg.norm(np.asarray(end) - start))
    return float(np.pi * radius**2 * length + 4.0 / 3.0 * np.pi * radius**3)


def minimum_volume_capsule(
    points: Array, starts: int = _REFINED_STARTS
) -> tuple[Array, Array, float]:
    """Smallest capsule found that contains all points: start (3,), end (3,) and radius [m].

    Containment is exact to rounding; minimality is that of a local search from several axes.

    Parameters
    ----------
    points: (N, 3) [m], N >= 1
    starts: axis directions that are refined; 1 is fast and nearly always as good

    Raises
    ------
    ValueError
        There is no point, or one is not finite.
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    if not len(points) or not np.isfinite(points).all():
        raise ValueError("minimum_volume_capsule needs at least one point, and finite ones")
    hull = hull_points(points)
    center = (hull.min(axis=0) + hull.max(axis=0)) / 2
    size = float(np.linalg.norm(hull - center, axis=1).max())
    if size < 1e-12:
        return center, center.copy(), size
    unit = (hull - center) / size
    best = min(_candidates(unit, starts), key=lambda capsule: capsule_volume(*capsule))
    start, end, radius = best
    return center + size * start, center + size * end, size * radius


def quick_capsule_volume(points: Array) -> float:
    """Volume [m^3] of a good, unrefined capsule around points (N, 3): to compare ways to cut.

    Looks only at the points farthest in 100 directions, so it may be a little too small.
    """
    extreme = points[np.unique(np.argmax(points @ sphere_points(100).T, axis=0))]
    extreme = extreme - extreme.mean(axis=0)
    return float(_crude_volumes(extreme, _start_axes(extreme, _FEW_DIRECTIONS))[0].min())


def hull_points(points: Array) -> Array:
    """Corners (M, 3) of the convex hull of points (N, 3), also of a flat or straight cloud."""
    if len(points) <= 4:
        return points
    try:
        return points[ConvexHull(points).vertices]
    except QhullError:  # flat, or nearly so: the hull within its plane
        return _flat_hull(points)


def _flat_hull(points: Array) -> Array:
    centred = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(centred, full_matrices=False)
    flat = centred @ axes[spread > 1e-9 * max(spread[0], 1e-12)].T
    if flat.shape[1] == 0:  # one and the same point
        return points[:1]
    if flat.shape[1] == 1:
        return points[[int(flat.argmin()), int(flat.argmax())]]
    try:
        return points[ConvexHull(flat).vertices]
    except QhullError:  # all points are as good
        return points


def _candidates(points: Array, starts: int) -> list[tuple[Array, Array, float]]:
    axes = _start_axes(points, _DIRECTIONS)
    volumes, centers = _crude_volumes(points, axes)
    order = [int(index) for index in np.argsort(volumes)]
    chosen = _distinct(axes, order, starts)
    found = [_capsule_along(points, axes[index], centers[index]) for index in chosen]
    return found + [_refined(points, capsule) for capsule in found]


def _distinct(axes: Array, order: list[int], count: int) -> list[int]:
    """First few of `order` whose axes are more than 25 degrees apart."""
    chosen: list[int] = []
    for index in order:
        if all(abs(float(axes[index] @ axes[other])) < 0.906 for other in chosen):
            chosen.append(index)
        if len(chosen) == count:
            break
    return chosen


@cache
def sphere_points(count: int) -> Array:
    """Fibonacci points (count, 3) on the unit sphere, evenly spread, those of z > 0 first."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])


def principal_axes(points: Array) -> Array:
    """Principal axes (3, 3) of points (N, 3), one a row, the longest first."""
    # Of fewer than three points only the full set has all three axes; of many it would be N by N.
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), full_matrices=len(points) < 3)[2])


def _start_axes(points: Array, count: int) -> Array:
    return np.vstack([principal_axes(points), np.eye(3), sphere_points(2 * count)[:count]])


def _crude_volumes(points: Array, axes: Array) -> tuple[Array, Array]:
    """Volume (A,) of an easy capsule along every axis, and a point (A, 3) of its line."""
    first, second = _across(axes)
    u, v = points @ first.T, points @ second.T  # (N, A)
    cu, cv = (u.min(0) + u.max(0)) / 2, (v.min(0) + v.max(0)) / 2
    for _ in range(6):  # a few steps towards the farthest point shrink the enclosing circle
        far = np.argmax((u - cu) ** 2 + (v - cv) ** 2, axis=0)
        reach = 0.12
        columns = np.arange(len(axes))
        cu, cv = cu + reach * (u[far, columns] - cu), cv + reach * (v[far, columns] - cv)
    rho2 = (u - cu) ** 2 + (v - cv) ** 2
    radius2 = rho2.max(axis=0)
    cap = np.sqrt(np.maximum(radius2 - rho2, 0.0))
    z = points @ axes.T
    length = np.maximum((z - cap).max(axis=0) - (z + cap).min(axis=0), 0.0)
    volume = np.pi * radius2 * length + 4 / 3 * np.pi * radius2**1.5
    return volume, cu[:, None] * first + cv[:, None] * second


def _across(axes: Array) -> tuple[Array, Array]:
    """Two unit vectors (A, 3) each, at right angles to every axis and to each other."""
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    first = np.cross(axes, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(axes, first)


def _capsule_along(
    points: Array, axis: Array, through: Array, radius: float = 0.0
) -> tuple[Array, Array, float]:
    """Shortest capsule on a line that contains all points, with at least the given radius."""
    relative = points - through
    z = relative @ axis
    rho2 = np.sum((relative - z[:, None] * axis) ** 2, axis=1)
    radius = max(float(np.sqrt(rho2.max())), radius) + _SLACK
    cap = np.sqrt(np.maximum(radius**2 - rho2, 0.0))
    low, high = float((z + cap).min()), float((z - cap).max())
    if low > high:  # a sphere holds them all
        low = high = (low + high) / 2
    return through + low * axis, through + high * axis, radius


def _refined(points: Array, capsule: tuple[Array, Array, float]) -> tuple[Array, Array, float]:
    """Local optimum near `capsule`, feasible for all points; SLSQP on the points that matter."""
    active = _touching(points, capsule)
    for _ in range(4):
        x0 = np.concatenate([capsule[0], capsule[1], [capsule[2]]])
        solution = minimize(
            _volume,
            x0,
            jac=True,
            method="SLSQP",
            constraints={
                "type": "ineq",
                "fun": _margins,
                "jac": _margins_jacobian,
                "args": (points[active],),
            },
            options={"maxiter": 60, "ftol": 1e-8},
        ).x
        if not np.isfinite(solution).all():
            break
        start, end, radius = solution[:3], solution[3:6], float(solution[6])
        distance = segment_distances(points, start, end)
        repaired = _repair(points, start, end, radius)
        if capsule_volume(*repaired) < capsule_volume(*capsule):
            capsule = repaired
        violated = distance > radius + 1e-7
        if not (violated & ~active).any():
            break
        active |= violated
    return capsule


def _touching(points: Array, capsule: tuple[Array, Array, float], count: int = 40) -> NDArray:
    """Mask of the points nearest to the capsule's surface: those that a small change can touch."""
    distance = segment_distances(points, capsule[0], capsule[1])
    mask = np.zeros(len(points), dtype=bool)
    mask[np.argsort(-distance)[:count]] = True
    mask[np.argmax(points @ sphere_points(30).T, axis=0)] = True
    return mask


def _repair(points: Array, start: Array, end: Array, radius: float) -> tuple[Array, Array, float]:
    along = end - start
    length = float(np.linalg.norm(along))
    axis = along / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    return _capsule_along(points, axis, (start + end) / 2, radius)


def _volume(x: Array) -> tuple[float, Array]:
    along, radius = x[3:6] - x[:3], x[6]
    length = np.sqrt(along @ along + 1e-12)
    side = np.pi * radius**2 * along / length
    slope = 2 * np.pi * radius * length + 4 * np.pi * radius**2
    value = np.pi * radius**2 * length + 4 / 3 * np.pi * radius**3
    return float(value), np.concatenate([-side, side, [slope]])


def _nearest(points: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """Share (N,) along the segment of the place nearest to each point, and the gap (N, 3)."""
    along = end - start
    share = np.clip((points - start) @ along / max(float(along @ along), 1e-24), 0.0, 1.0)
    return share, points - start - share[:, None] * along


def segment_distances(points: Array, start: Array, end: Array) -> Array:
    """Distances (N,) [m] of points (N, 3) from the segment from `start` to `end`, (3,) each."""
    return np.linalg.norm(_nearest(points, start, end)[1], axis=1)


def _margins(x: Array, points: Array) -> Array:
    return x[6] - segment_distances(points, x[:3], x[3:6])


def _margins_jacobian(x: Array, points: Array) -> Array:
    share, gap = _nearest(points, x[:3], x[3:6])
    normal = gap / np.maximum(np.linalg.norm(gap, axis=1, keepdims=True), 1e-12)
    return np.hstack(
        [(1 - share[:, None]) * normal, share[:, None] * normal, np.ones((len(points), 1))]
    )
