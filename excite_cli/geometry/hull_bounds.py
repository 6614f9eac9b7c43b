"""Lower bounds of the distance of two convex hulls at many instants at once.

For any unit vector u, all of B lies at least  min_B u·x − max_A u·x  beyond A: a proof whatever u
is, and only its sharpness depends on u. Gilbert's iteration finds a good one: v is a point of
B − A, w the corner of B − A that is lowest along u = v/|v| (so u·w is the bound), and the next v
is the point of the segment from v to w that is nearest to the origin.
"""

import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.link_meshes import LinkMesh, Poses
from excite_cli.geometry.world_segments import nearest_points

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_STEPS = 8
_CROSSED = 1e-9  # [m] hulls nearer than this have no direction between them


def ball_bounds(poses: Poses, meshes: tuple[LinkMesh, ...], pairs: Indices) -> Array:
    """Lower bounds (P, T) [m] of the distance of pairs (P, 2) of links, from balls around them."""
    if not len(pairs):
        return np.zeros((0, len(poses)))
    centers = [np.ascontiguousarray(poses.points(m.joint, m.center).T) for m in meshes]
    found = np.empty((len(pairs), len(poses)))
    for bounds, (first, second) in zip(found, pairs.tolist(), strict=True):
        x, y, z = centers[first] - centers[second]
        np.sqrt(x * x + y * y + z * z, out=bounds)
        bounds -= meshes[first].radius + meshes[second].radius
    return found


def hull_bounds(
    poses: Poses, pair: tuple[LinkMesh, LinkMesh], instants: Indices, enough: Array
) -> Array:
    """Lower bounds (K,) [m] of the distance of two links' hulls at `instants` (K,).

    A bound is improved until it exceeds `enough` (K,) [m]; hulls that cross have one below zero.
    """
    one, two = (
        (poses.rotations[instants, mesh.joint], poses.translations[instants, mesh.joint])
        for mesh in pair
    )
    place = _first_guess(pair, one, two)
    bounds = np.full(len(instants), -np.inf)
    going = np.arange(len(instants))
    for _ in range(_STEPS):
        length = np.sqrt(np.einsum("kx,kx->k", place, place))
        keep = length > _CROSSED
        going, place, length = going[keep], place[keep], length[keep]
        if not len(going):
            break
        u = place / length[:, None]
        first, second = _support(pair[0], one, going, u), _support(pair[1], two, going, -u)
        corner = second - first
        found = np.einsum("kx,kx->k", u, corner)
        bounds[going] = np.maximum(bounds[going], found)
        keep = bounds[going] <= enough[going]
        going, place, corner = going[keep], place[keep], corner[keep]
        step = corner - place
        size = np.maximum(np.einsum("kx,kx->k", step, step), 1e-18)
        share = np.clip(-np.einsum("kx,kx->k", place, step) / size, 0.0, 1.0)
        place = place + share[:, None] * step
    return bounds


def _first_guess(
    pair: tuple[LinkMesh, LinkMesh], one: tuple[Array, Array], two: tuple[Array, Array]
) -> Array:
    """From the first link to the second (K, 3) between the nearest points of their spines."""
    ends = []
    for mesh, (rotations, translations) in zip(pair, (one, two), strict=True):
        start = rotations @ mesh.spine[0] + translations
        ends += [start.T, (rotations @ (mesh.spine[1] - mesh.spine[0])).T]
    gap = nearest_points(*ends).gap.T
    centers = [r @ mesh.center + p for mesh, (r, p) in zip(pair, (one, two), strict=True)]
    crossed = np.einsum("kx,kx->k", gap, gap) < _CROSSED**2
    return np.asarray(np.where(crossed[:, None], centers[1] - centers[0], gap))


def _support(mesh: LinkMesh, placed: tuple[Array, Array], rows: Indices, u: Array) -> Array:
    """Corners (K, 3) in the world of a link's hull that lie farthest along u (K, 3)."""
    rotations, translations = placed[0][rows], placed[1][rows]
    local = np.einsum("kx,kxy->ky", u, rotations)
    farthest = mesh.hull[(local @ mesh.hull.T).argmax(axis=1)]
    return np.asarray(np.einsum("kxy,ky->kx", rotations, farthest) + translations)
