"""Signed distances of many segments from a box, in the frame of the box.

Outside, f(λ) = Σ_k max(|p_k + λ u_k| − e_k, 0)² (the squared distance of the point p + λ u from the
box |x_k| ≤ e_k) is convex with a derivative that is piecewise linear, non-decreasing, and bends
only where |p_k + λ u_k| = e_k. So the root of f' lies between two neighbours of those six λ and the
ends 0 and 1, and follows by linear interpolation: exact, no iteration.

Where the segment enters the box the distance is minus the shortest way out, the largest of
    n·(segment's lowest point along n) − Σ_k |n_k| e_k
over the directions n that can be normal to a face of box minus segment: ±e_k and ±(e_k × u).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CONTACT = 1e-10  # [m] below which the gap has no direction
_FLAT = 1e-12  # [m²] slopes of f/2 below this are zero: the segment is level with a face
_PARALLEL = 1e-9  # sine of the angle below which a segment has the direction of an edge


class BoxContact(NamedTuple):
    """Signed distance (K,) [m], unit normal (3, K) away from the obstacle, share (K,) of the axis.

    The distance changes as the point at the share of the axis moves along the normal.
    """

    distance: Array
    normal: Array
    share: Array


def segment_distances(start: Array, along: Array, half: Array) -> Array:
    """Signed distances (...) [m] of segments start + λ along, λ in [0, 1], from a box.

    start, along: (3, ...) in the frame of the box; half: (3,) half its edges [m].
    """
    shape = start.shape[1:]
    p, u = start.reshape(3, -1), along.reshape(3, -1)
    gap = _gap(p, u, half, _nearest_share(p, u, half))
    distance = np.asarray(np.sqrt(_dot(gap, gap)))
    inside = np.flatnonzero(distance < _CONTACT)
    if len(inside):
        distance[inside] = _way_out(p[:, inside], u[:, inside], half).distance
    return distance.reshape(shape)


def segment_contacts(start: Array, along: Array, half: Array) -> BoxContact:
    """As `segment_distances`, with normals and shares; start, along: (3, K)."""
    share = _nearest_share(start, along, half)
    gap = _gap(start, along, half, share)
    distance = np.asarray(np.sqrt(_dot(gap, gap)))
    normal = gap / np.maximum(distance, _CONTACT)
    inside = np.flatnonzero(distance < _CONTACT)
    if len(inside):
        out = _way_out(start[:, inside], along[:, inside], half)
        distance[inside], normal[:, inside], share[inside] = out
    return BoxContact(distance, normal, share)


def point_distances(points: Array, half: Array) -> Array:
    """Signed distances (...) [m] of points (3, ...) from the box."""
    beyond = np.abs(points) - half.reshape(3, *(1,) * (points.ndim - 1))
    outside = np.maximum(beyond, 0.0)
    return np.asarray(np.sqrt(_dot(outside, outside)) + np.minimum(beyond.max(axis=0), 0.0))


def _nearest_share(p: Array, u: Array, half: Array) -> Array:
    """λ (N,) of the nearest point; the middle of all of them where there are many."""
    first, last = _slope(p, u, half, np.zeros(1)), _slope(p, u, half, np.ones(1))
    share = np.where(last < -_FLAT, 1.0, 0.0)
    between = np.flatnonzero((first <= _FLAT) & (last >= -_FLAT))
    if not len(between):
        return share
    p, u = p[:, between], u[:, between]
    share[between] = _root(p, u, half, first[between], last[between])
    return share


def _root(p: Array, u: Array, half: Array, first: Array, last: Array) -> Array:
    """λ (N,) where f' changes its sign; `first`, `last` (N,) are f'/2 at 0 and 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        bends = np.concatenate([(half[:, None] - p) / u, (-half[:, None] - p) / u])
    bends = np.fmax(np.fmin(bends, 1.0), 0.0)  # takes nan, a segment level with a face, to 1
    slopes = _slope(p[:, None], u[:, None], half, bends)
    falling, rising = slopes < -_FLAT, slopes > _FLAT
    # The last λ that is not beyond the root, the first that is not before it, and f'/2 there.
    low = np.where(last <= _FLAT, 1.0, np.where(rising, 0.0, bends).max(axis=0))
    high = np.where(first >= -_FLAT, 0.0, np.where(falling, 1.0, bends).min(axis=0))
    under = np.maximum(first, np.where(rising, -np.inf, slopes).max(axis=0))
    over = np.minimum(last, np.where(falling, np.inf, slopes).min(axis=0))
    crossing = low < high  # else every λ between is a root
    step = (high - low) * -under / np.where(crossing, over - under, 1.0)
    return np.where(crossing, low + step, 0.5 * (low + high))


def _slope(p: Array, u: Array, half: Array, share: Array) -> Array:
    """f'(λ)/2 = u · (x − nearest point of the box), x = p + λ u."""
    total = np.zeros(np.broadcast_shapes(p.shape[1:], share.shape))
    x, nearest = np.empty_like(total), np.empty_like(total)
    for k in range(3):
        np.multiply(share, u[k], out=x)
        x += p[k]
        np.minimum(x, half[k], out=nearest)
        np.maximum(nearest, -half[k], out=nearest)
        x -= nearest
        x *= u[k]
        total += x
    return total


def _gap(p: Array, u: Array, half: Array, share: Array) -> Array:
    """From the nearest point of the box to the point of the segment, (3, N)."""
    x = p + share * u
    return x - np.clip(x, -half[:, None], half[:, None])


def _way_out(p: Array, u: Array, half: Array) -> BoxContact:
    """The shortest way out of the box for segments (3, K) that enter it."""
    count = p.shape[1]
    low, high = np.minimum(p, p + u), np.maximum(p, p + u)
    apart, sign = np.empty((6, count)), np.empty((6, count))
    apart[:3] = np.maximum(low, -high) - half[:, None]
    sign[:3] = np.where(low >= -high, 1.0, -1.0)
    sine, length = np.empty((3, count)), np.sqrt(_dot(u, u))
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        sine[k] = np.hypot(u[i], u[j])
        across = u[i] * p[j] - u[j] * p[i]
        support = np.abs(u[i]) * half[j] + np.abs(u[j]) * half[i]
        possible = sine[k] > _PARALLEL * np.maximum(length, _PARALLEL)
        safe = np.where(possible, sine[k], 1.0)
        apart[3 + k] = np.where(possible, (np.abs(across) - support) / safe, -np.inf)
        sign[3 + k] = np.where(across >= 0, 1.0, -1.0)
    best, every = np.argmax(apart, axis=0), np.arange(count)
    face, axis, turn = best < 3, best % 3, sign[best, every]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    normal = np.zeros((3, count))
    normal[i, every] = np.where(face, 0.0, -turn * u[j, every])
    normal[j, every] = np.where(face, 0.0, turn * u[i, every])
    normal[axis, every] = np.where(face, turn, 0.0)
    normal /= np.where(face, 1.0, sine[axis, every])
    end = (turn * u[axis, every] < 0).astype(float)
    share = np.where(face, end, _facing(p, u, half, axis, normal))
    return BoxContact(apart[best, every], normal, share)


def _facing(p: Array, u: Array, half: Array, axis: Array, normal: Array) -> Array:
    """λ (K,) where each segment is nearest to the edge along `axis` that `normal` points to."""
    corner = np.sign(normal) * half[:, None]
    across = u.copy()
    across[axis, np.arange(p.shape[1])] = 0.0
    share = _dot(corner - p, across) / np.maximum(_dot(across, across), np.finfo(float).tiny)
    return np.clip(share, 0.0, 1.0)


def _dot(left: Array, right: Array) -> Array:
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]
