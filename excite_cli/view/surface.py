"""Triangles with normals: welded, creased, made coarser, and made from simple shapes."""

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from excite_cli.arrays import Array, Indices

_CREASE = np.cos(np.radians(35.0))  # faces that meet at less are one smooth surface
_HALF_CREASE = np.cos(np.radians(17.5))
_RIM = 48
_RINGS = 8


class Triangles(NamedTuple):
    """points (V, 3) [m], faces (F, 3) indices of points, counter-clockwise from outside."""

    points: Array
    faces: Indices


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles with one unit normal for each point.

    points, normals: (V, 3) [m, 1]; faces: (F, 3) indices. Points are doubled along creases.
    """

    points: Array
    normals: Array
    faces: Indices

    def moved(self, rotation: Array, translation: Array) -> "Surface":
        """The surface at rotation (3, 3), translation (3,) [m]."""
        return Surface(
            self.points @ rotation.T + translation, self.normals @ rotation.T, self.faces
        )


def smooth_surface(triangles: Triangles, cell: float = 0.0) -> Surface:
    """Weld points, drop what has no area, and find normals that keep creases sharp.

    cell: points within a cube of this edge [m] become one; 0 welds equal points only.
    """
    points, faces = _welded(triangles, cell)
    if not len(faces):
        return Surface(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp))
    sides = points[faces]
    area = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    flat = area / np.linalg.norm(area, axis=1, keepdims=True)
    smooth, normals = _smooth_points(faces, area, flat, len(points))
    owner = faces.reshape(-1)
    creased = np.flatnonzero(~smooth[owner])
    corners = _corner_normals(owner[creased], creased // 3, area, flat)
    # Corners of one point with nearly one normal are one point of the surface.
    keys = np.column_stack([owner[creased], np.round(corners * 50).astype(np.int64) + 50])
    first, inverse = _same_rows(keys)
    number = np.cumsum(smooth) - 1
    joined = number[owner]
    joined[creased] = smooth.sum() + inverse
    return Surface(
        np.vstack([points[smooth], points[owner[creased][first]]]),
        np.vstack([normals[smooth], corners[first]]),
        joined.reshape(-1, 3).astype(np.intp),
    )


def _smooth_points(
    faces: Indices, area: Array, flat: Array, count: int
) -> tuple[NDArray[np.bool_], Array]:
    """Points whose faces are all within half a crease of their mean, and these means (V, 3).

    No two such faces are a crease apart, so that the point has one normal.
    """
    owner = faces.reshape(-1)
    sums = [np.bincount(owner, np.repeat(area[:, k], 3), count) for k in range(3)]
    total = np.column_stack(sums).astype(float)
    normals = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
    within = np.einsum("fcx,fx->fc", normals[faces], flat) > _HALF_CREASE
    away = np.bincount(owner, ~within.reshape(-1), count)
    smooth = (away == 0) & (np.bincount(owner, minlength=count) > 0)
    return np.asarray(smooth), np.asarray(normals)


def _same_rows(keys: NDArray[np.int64]) -> tuple[Indices, Indices]:
    """First of each set of equal rows (N, k), and which set each row belongs to."""
    one = keys - keys.min(axis=0, initial=0)
    spans = one.max(axis=0, initial=0) + 1
    if float(np.prod(spans.astype(float))) < 2.0**62:  # as one number: many times faster
        total = one[:, 0]
        for k in range(1, one.shape[1]):
            total = total * spans[k] + one[:, k]
        _, first, inverse = np.unique(total, return_index=True, return_inverse=True)
    else:
        _, first, inverse = np.unique(one, axis=0, return_index=True, return_inverse=True)
    return np.asarray(first), np.asarray(inverse.ravel())


def _welded(triangles: Triangles, cell: float) -> Triangles:
    points, faces = triangles
    size = float(np.ptp(points, axis=0).max(initial=0.0))
    grid = np.round(points / (cell or max(size, 1e-9) * 1e-6)).astype(np.int64)
    _, inverse = _same_rows(grid)
    count = np.bincount(inverse)
    merged = np.column_stack([np.bincount(inverse, points[:, k]) / count for k in range(3)])
    faces = inverse[faces]
    sides = merged[faces]
    area = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    proper = np.linalg.norm(area, axis=1) > 1e-12 * max(size, 1e-6) ** 2
    return Triangles(merged, faces[proper].astype(np.intp))


def _corner_normals(owner: Indices, face: Indices, area: Array, flat: Array) -> Array:
    """Normals (K, 3) of corners, each of a point (K,) and a face (K,).

    All corners of a point are there; its normal is that of the faces that are no crease away.
    """
    if not len(owner):
        return np.zeros((0, 3))
    order = np.argsort(owner, kind="stable")
    owner, face = owner[order], face[order]
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    counts = np.diff(np.append(starts, len(owner)))
    total = np.zeros((len(owner), 3))
    begin, length = np.repeat(starts, counts), np.repeat(counts, counts)
    # Step k compares each corner with the k-th next one about the same point: as many steps as
    # the busiest point has faces, each over fewer corners.
    at = np.arange(len(owner))
    for step in range(int(counts.max())):
        some = at[length > step]
        other = begin[some] + (some - begin[some] + step) % length[some]
        near = np.einsum("kx,kx->k", flat[face[some]], flat[face[other]]) > _CREASE
        total[some[near]] += area[face[other[near]]]
    corners = np.empty_like(total)
    corners[order] = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
    return corners


def box_triangles(half: Array) -> Triangles:
    """A box about the origin with half edges (3,) [m]."""
    return hull_triangles(np.array(list(product((-1.0, 1.0), repeat=3))) * half)


def hull_triangles(points: Array) -> Triangles:
    """The convex hull of points (V, 3); nothing where they are flat."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return Triangles(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp))
    faces = hull.simplices.astype(np.intp)
    sides = points[faces]
    normal = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    inwards = np.einsum("kx,kx->k", normal, hull.equations[:, :3]) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return Triangles(points, faces)


def round_triangles(profile: Array) -> Triangles:
    """A profile (P, 2) of radius and height [m], from below upwards, turned about the z axis."""
    angles = 2 * np.pi * np.arange(_RIM) / _RIM
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    rings = profile[:, :1, None] * circle  # (P, rim, 2)
    heights = np.broadcast_to(profile[:, 1, None, None], (len(profile), _RIM, 1))
    points = np.concatenate([rings, heights], axis=2).reshape(-1, 3)
    here = np.arange(_RIM)
    ahead = (here + 1) % _RIM
    faces = []
    for ring in range(len(profile) - 1):
        low, high = ring * _RIM, (ring + 1) * _RIM
        faces += [
            np.column_stack([low + here, low + ahead, high + ahead]),
            np.column_stack([low + here, high + ahead, high + here]),
        ]
    return Triangles(points, np.vstack(faces).astype(np.intp))


def cylinder_triangles(radius: float, half: float, top: float | None = None) -> Triangles:
    """A cylinder along z; with another radius at its top [m], a cone."""
    top = radius if top is None else top
    return round_triangles(np.array([[0, -half], [radius, -half], [top, half], [0, half]]))


def ball_profile(radius: float, half: float) -> Array:
    """Profile of a capsule of half length `half` [m] along z; of a ball for 0."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 2 * _RINGS + 1)
    shift = np.where(np.arange(len(angles)) < _RINGS, -half, half)
    profile = np.column_stack([radius * np.cos(angles), radius * np.sin(angles) + shift])
    profile[[0, -1], 0] = 0.0
    middle = np.array([[radius, -half]])
    return np.insert(profile, _RINGS, middle, axis=0) if half > 0 else profile


def capsule_triangles(start: Array, end: Array, radius: float) -> Triangles:
    """All points within `radius` of the segment from start to end (3,) [m]."""
    along = end - start
    length = float(np.linalg.norm(along))
    points, faces = round_triangles(ball_profile(radius, length / 2))
    return Triangles(points @ turn_to(along).T + (start + end) / 2, faces)


def turn_to(direction: Array) -> Array:
    """A rotation (3, 3) that takes the z axis to `direction` (3,); the identity for zero."""
    length = float(np.linalg.norm(direction))
    if length < 1e-12:
        return np.eye(3)
    z = direction / length
    side = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(side, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
