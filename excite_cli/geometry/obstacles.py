"""Obstacles that stand in the world: half-spaces (a floor, walls) and boxes."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array
from excite_cli.config.constraints_spec import BoxSpec, SurroundingsSpec, WallSpec
from excite_cli.geometry.world_segments import dot

FLOOR = "floor"

# Signed distances of many segments from a box, in the frame of the box.
#
# Outside, f(λ) = Σ_k max(|p_k + λ u_k| − e_k, 0)² (the squared distance of the point p + λ u from
# the box |x_k| ≤ e_k) is convex with a derivative that is piecewise linear, non-decreasing, and
# bends only where |p_k + λ u_k| = e_k. So the root of f' lies between two neighbours of those six
# λ and the ends 0 and 1, and follows by linear interpolation: exact, no iteration.
#
# Where the segment enters the box the distance is minus the shortest way out, the largest of
#     n·(segment's lowest point along n) − Σ_k |n_k| e_k
# over the directions n that can be normal to a face of box minus segment: ±e_k and ±(e_k × u).

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
    distance = np.asarray(np.sqrt(dot(gap, gap)))
    inside = np.flatnonzero(distance < _CONTACT)
    if len(inside):
        distance[inside] = _way_out(p[:, inside], u[:, inside], half).distance
    return distance.reshape(shape)


def segment_contacts(start: Array, along: Array, half: Array) -> BoxContact:
    """As `segment_distances`, with normals and shares; start, along: (3, K)."""
    share = _nearest_share(start, along, half)
    gap = _gap(start, along, half, share)
    distance = np.asarray(np.sqrt(dot(gap, gap)))
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
    return np.asarray(np.sqrt(dot(outside, outside)) + np.minimum(beyond.max(axis=0), 0.0))


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
    sine, length = np.empty((3, count)), np.sqrt(dot(u, u))
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
    share = dot(corner - p, across) / np.maximum(dot(across, across), np.finfo(float).tiny)
    return np.clip(share, 0.0, 1.0)


class Obstacle(ABC):
    """A solid body that does not move. Segments are start + λ along, λ in [0, 1], (3, ...) [m]."""

    name: str

    @abstractmethod
    def distances(self, start: Array, along: Array) -> Array:
        """Signed distances (...) [m] of segments; negative: how far the way out is."""

    @abstractmethod
    def point_distances(self, points: Array) -> Array:
        """Signed distances (...) [m] of points (3, ...)."""

    @abstractmethod
    def contacts(self, start: Array, along: Array) -> BoxContact:
        """Distances, normals in the world and shares of segments (3, K)."""

    @abstractmethod
    def as_coal(self, scale: float) -> tuple[coal.CollisionGeometry, Array, Array]:
        """Its shape for coal, enlarged, with the rotation (3, 3) and position (3,) [m] of that."""

    @abstractmethod
    def in_words(self, depth: float) -> str:
        """Where something is whose signed distance is −depth [m], depth > 0."""


@dataclass(frozen=True, eq=False)
class Plane(Obstacle):
    """The half-space normal·x < offset; `normal` (3,) is a unit vector, `offset` in metres."""

    name: str
    normal: Array
    offset: float

    def distances(self, start: Array, along: Array) -> Array:
        """Distance of the end that is lower along the normal."""
        height = np.tensordot(self.normal, start, 1) - self.offset
        return np.asarray(height + np.minimum(np.tensordot(self.normal, along, 1), 0.0))

    def point_distances(self, points: Array) -> Array:
        """normal·x − offset."""
        return np.asarray(np.tensordot(self.normal, points, 1) - self.offset)

    def contacts(self, start: Array, along: Array) -> BoxContact:
        """At the lower end; in the middle where the axis is level."""
        rise = self.normal @ along
        share = np.where(rise < 0, 1.0, np.where(rise > 0, 0.0, 0.5))
        distance = self.normal @ start - self.offset + np.minimum(rise, 0.0)
        return BoxContact(distance, np.repeat(self.normal[:, None], start.shape[1], 1), share)

    def as_coal(self, scale: float) -> tuple[coal.CollisionGeometry, Array, Array]:
        """A half-space of the world."""
        return coal.Halfspace(self.normal, scale * self.offset), np.eye(3), np.zeros(3)

    def in_words(self, depth: float) -> str:
        """`0.12 m below floor`, or behind a wall."""
        return f"{depth:.3f} m {'below the' if self.name == FLOOR else 'behind'} {self.name}"


@dataclass(frozen=True, eq=False)
class Box(Obstacle):
    """A box about `position` (3,) [m]; `rotation` (3, 3) to the world; `half` (3,) its edges."""

    name: str
    rotation: Array
    position: Array
    half: Array

    def _inside(self, start: Array, along: Array) -> tuple[Array, Array]:
        """Segments in the frame of the box."""
        place = self.position.reshape(3, *(1,) * (start.ndim - 1))
        turn = self.rotation.T
        return np.tensordot(turn, start - place, 1), np.tensordot(turn, along, 1)

    def distances(self, start: Array, along: Array) -> Array:
        """See `segment_box`."""
        return segment_distances(*self._inside(start, along), self.half)

    def point_distances(self, points: Array) -> Array:
        """Distance of points, minus the way to the nearest face inside."""
        place = self.position.reshape(3, *(1,) * (points.ndim - 1))
        return point_distances(np.tensordot(self.rotation.T, points - place, 1), self.half)

    def contacts(self, start: Array, along: Array) -> BoxContact:
        """See `segment_box`."""
        distance, normal, share = segment_contacts(*self._inside(start, along), self.half)
        return BoxContact(distance, self.rotation @ normal, share)

    def as_coal(self, scale: float) -> tuple[coal.CollisionGeometry, Array, Array]:
        """A box in its own place."""
        return coal.Box(*(2 * scale * self.half).tolist()), self.rotation, self.position

    def in_words(self, depth: float) -> str:
        """`0.12 m inside table`."""
        return f"{depth:.3f} m inside {self.name}"


def build_obstacles(spec: SurroundingsSpec) -> tuple[Obstacle, ...]:
    """Floor, walls and boxes of the config, in that order."""
    found: list[Obstacle] = []
    if spec.floor is not None:
        found.append(Plane(FLOOR, np.array([0.0, 0.0, 1.0]), spec.floor))
    found += [_wall(name, wall) for name, wall in spec.walls.items()]
    found += [_box(name, box) for name, box in spec.boxes.items()]
    return tuple(found)


def _wall(name: str, spec: WallSpec) -> Plane:
    normal = np.array(spec.normal) / np.linalg.norm(spec.normal)
    return Plane(name, normal, float(normal @ np.array(spec.point)))


def _box(name: str, spec: BoxSpec) -> Box:
    rotation = np.array(pin.rpy.rpyToMatrix(*spec.orientation))
    return Box(name, rotation, np.array(spec.position), np.array(spec.size) / 2)
