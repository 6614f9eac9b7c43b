"""A pinhole camera, and rays against triangles: which surface they meet first, what is in the way.

Embree does the work on the processor, so that pictures need no display and no graphics driver.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import optional_module
from excite_cli.robot.model import Array
from excite_cli.view.surface import Surface

Singles = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Hits:
    """What K rays meet: distance (K,) [m], infinite where nothing; part (K,), the index of the
    surface, -1 where nothing; normal (K, 3), smooth, towards the ray's origin.
    """

    distance: Array
    part: NDArray[np.intp]
    normal: Array


def embree_part(name: str) -> Any:
    """The module `embreex.<name>`.

    Raises
    ------
    MissingExtraError
        embreex is not installed.
    """
    return optional_module(
        f"embreex.{name}",
        "Pictures of the robot need embreex, which is not installed. Run: "
        "pip install 'excite-cli[view]' (there are no wheels for Linux on ARM; `excite view` "
        "in the browser works there).",
    )


class Tracer:
    """A set of surfaces that rays can be sent against; it is empty without surfaces."""

    def __init__(self, surfaces: Sequence[Surface], first_part: int = 0) -> None:
        self._scene: Any = None
        full = [(k, one) for k, one in enumerate(surfaces, first_part) if len(one.faces)]
        if not full:
            return
        shifts = np.cumsum([0, *(len(one.points) for _, one in full)])
        points = np.vstack([one.points for _, one in full])
        self._normals = np.vstack([one.normals for _, one in full])
        parts = zip(full, shifts[:-1], strict=True)
        self._faces = np.vstack([one.faces + shift for (_, one), shift in parts])
        self._parts = np.repeat([k for k, _ in full], [len(one.faces) for _, one in full])
        self._low, self._high = points.min(axis=0), points.max(axis=0)
        self._scene = embree_part("rtcore_scene").EmbreeScene()
        # The scene keeps no reference of its own to its meshes.
        self._mesh = embree_part("mesh_construction").TriangleMesh(
            self._scene, points.astype(np.float32), self._faces.astype(np.int32)
        )

    @property
    def ball(self) -> tuple[Array, float]:
        """Centre (3,) and radius [m] of a ball around everything."""
        if self._scene is None:
            return np.zeros(3), 0.0
        radius = float(np.linalg.norm(self._high - self._low)) / 2
        return (self._low + self._high) / 2, radius

    def first_hits(self, origins: Array, directions: Array) -> Hits:
        """What rays from origins (K, 3) along unit directions (K, 3) meet first."""
        count = len(origins)
        distance, part = np.full(count, np.inf), np.full(count, -1, dtype=np.intp)
        normal = np.zeros((count, 3))
        if self._scene is None or not count:
            return Hits(distance, part, normal)
        center, radius = self.ball
        between = center - origins
        along = np.einsum("kx,kx->k", between, directions)
        off = np.einsum("kx,kx->k", between, between) - along**2
        maybe = np.flatnonzero((off < radius**2) & (along > -radius))
        if not len(maybe):
            return Hits(distance, part, normal)
        answer = self._scene.run(_singles(origins[maybe]), _singles(directions[maybe]), output=True)
        met = np.flatnonzero(answer["primID"] >= 0)
        at = maybe[met]
        face = answer["primID"][met]
        distance[at] = answer["tfar"][met]
        part[at] = self._parts[face]
        u, v = answer["u"][met, None], answer["v"][met, None]
        a, b, c = (self._normals[self._faces[face, corner]] for corner in range(3))
        smooth = (1 - u - v) * a + u * b + v * c
        flat = answer["Ng"][met].astype(float)
        away = directions[at]
        # The flat normal says which side is seen; meshes of robots are not always outside out.
        side = -np.sign(np.einsum("kx,kx->k", flat, away))[:, None]
        flat *= side / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
        smooth *= np.sign(np.einsum("kx,kx->k", smooth, flat))[:, None]
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        normal[at] = np.where(length > 1e-6, smooth / np.maximum(length, 1e-30), flat)
        return Hits(distance, part, normal)

    def blocked(self, origins: Array, direction: Array) -> NDArray[np.bool_]:
        """Whether anything is on the way from origins (K, 3) along one direction (3,)."""
        found = np.zeros(len(origins), dtype=bool)
        if self._scene is None or not len(origins):
            return found
        center, radius = self.ball
        between = center - origins
        along = between @ direction
        off = np.einsum("kx,kx->k", between, between) - along**2
        maybe = np.flatnonzero((off < radius**2) & (along > -radius))
        if len(maybe):
            toward = np.broadcast_to(direction, (len(maybe), 3))
            answer = self._scene.run(_singles(origins[maybe]), _singles(toward), query="OCCLUDED")
            found[maybe] = answer >= 0
        return found


def _singles(values: Array) -> Singles:
    return np.ascontiguousarray(values, dtype=np.float32)


# A pinhole camera: where it stands so that everything is seen, its rays, and its projection.

_FIELD = np.radians(28.0)  # of view, across the shorter side of the picture
_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Camera:
    """eye (3,) [m]; axes (3, 3), rows right, up and forward; width, height in pixels; focal length
    in pixels.
    """

    eye: Array
    axes: Array
    width: int
    height: int
    focal: float

    def rays(self, x: Array, y: Array) -> Array:
        """Unit directions (K, 3) through pixel places x, y (K,), from the upper left corner."""
        across = (np.asarray(x) - self.width / 2) / self.focal
        down = (np.asarray(y) - self.height / 2) / self.focal
        directions = np.stack([across, -down, np.ones_like(across)], axis=-1) @ self.axes
        return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))

    def project(self, points: Array) -> Array:
        """Pixel places (..., 2) of points (..., 3) [m] before the camera."""
        local = (np.asarray(points) - self.eye) @ self.axes.T
        depth = np.maximum(local[..., 2:], 1e-6)
        middle = np.array([self.width / 2, self.height / 2])
        return np.asarray(middle + self.focal * local[..., :2] * [1, -1] / depth)


def fitted_camera(
    points: Array, size: tuple[int, int], azimuth: float, elevation: float, fill: float = 0.9
) -> Camera:
    """A camera that sees all `points` (K, 3) [m] within a share `fill` of the picture.

    azimuth [°]: where it stands about the points, from the x axis counter-clockwise, seen from
    above; elevation [°]: how far above the horizon. size: pixels, across and down.
    """
    turn, rise = np.radians(azimuth), np.radians(np.clip(elevation, -89.0, 89.0))
    outwards = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    forward = -outwards
    right = np.array([-np.sin(turn), np.cos(turn), 0.0])
    axes = np.stack([right, np.cross(right, forward), forward])
    width, height = size
    focal = min(size) / 2 / np.tan(_FIELD / 2)
    reach = fill * np.array([width, height]) / 2 / focal
    local = points @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    middle = (low + high) / 2
    distance = float(np.linalg.norm(high - low))
    for _ in range(_ROUNDS):  # the nearer a point, the more it moves the picture's middle
        flat, depth = local[:, :2] - middle[:2], local[:, 2] - middle[2]
        distance = max(float((np.abs(flat) / reach - depth[:, None]).max()), 1e-3)
        seen = flat / (distance + depth)[:, None]
        middle[:2] += distance * (seen.min(axis=0) + seen.max(axis=0)) / 2
    return Camera((middle - np.array([0, 0, distance])) @ axes, axes, width, height, float(focal))
