"""A pinhole camera: where it stands so that everything is seen, its rays, and its projection."""

from dataclasses import dataclass

import numpy as np

from excite_cli.robot.model import Array

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
