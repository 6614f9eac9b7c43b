"""Obstacles that stand in the world: half-spaces (a floor, walls) and boxes."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.config.constraints_spec import BoxSpec, SurroundingsSpec, WallSpec
from excite_cli.geometry.segment_box import (
    BoxContact,
    point_distances,
    segment_contacts,
    segment_distances,
)

Array = NDArray[np.float64]

FLOOR = "floor"


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
