"""The ground of a picture: a grid on paper that fades away from the robot."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from excite_cli.robot.model import Array
from excite_cli.view.geometry import Colour
from excite_cli.view.scene import Scene

PAPER: Colour = (1.0, 1.0, 1.0)
_FLOOR: Colour = (0.945, 0.95, 0.96)
_LINE: Colour = (0.80, 0.82, 0.85)
_CELLS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0)  # [m]
_LINES = 6  # about so many cells across the scene
_THICK = 0.012  # share of a cell
_FADE = (0.6, 1.25)  # shares of the scene's size between which the ground fades
_SPREAD = 0.8  # how far shadows fall, as a share of the scene's height above the ground
_BLUR = 1.6  # patches; it hides that a lamp is a few rays only

Light = Callable[[Array, Array], Array]


class GroundPlane:
    """A level plane below `scene`; unseen from below."""

    def __init__(self, scene: Scene) -> None:
        self._height, self._size = scene.ground, scene.size
        self._center, self._low, self._high = scene.center[:2], scene.low, scene.high
        self._cell = min(_CELLS, key=lambda cell: abs(np.log(cell * _LINES / scene.size)))

    def distances(self, origins: Array, directions: Array) -> Array:
        """Distance (K,) [m] to the ground along rays; infinite where they miss it."""
        drop = origins[:, 2] - self._height
        falling = (directions[:, 2] < -1e-9) & (drop > 0)
        found = np.full(len(origins), np.inf)
        found[falling] = -drop[falling] / directions[falling, 2]
        return found

    def shade(self, patches: int, light: Light) -> "Shade":
        """How light the ground is, where `light` (points, normals) says it for some places.

        patches: how many along the longer side.
        """
        reach = _SPREAD * max(float(self._high[2]) - self._height, 0.1)
        low, high = self._low[:2] - reach, self._high[:2] + reach
        edge = float((high - low).max()) / patches
        counts = np.ceil((high - low) / edge).astype(int) + 1
        x, y = (low[k] + edge * np.arange(counts[k]) for k in range(2))
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.column_stack([grid, np.full(len(grid), self._height)])
        up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)
        values = np.minimum(light(points, up), 1.0).reshape(counts)
        return Shade(low, edge, gaussian_filter(values, _BLUR, mode="nearest"))

    def colours(self, points: Array, pixel: Array, directions: Array) -> Array:
        """sRGB colours (K, 3); `pixel` (K,) [m]: how wide a pixel is at each point."""
        lines = np.zeros(len(points))
        half = _THICK * self._cell / 2
        steep = np.maximum(-directions[:, 2], 0.05)
        for axis in range(2):
            # Along its view the ground is foreshortened: a pixel covers more of it.
            across = np.abs(directions[:, axis])
            blur = pixel * np.sqrt(1 + (across / steep) ** 2)
            off = np.abs((points[:, axis] / self._cell + 0.5) % 1 - 0.5) * self._cell
            share = np.clip((half + blur / 2 - off) / blur, 0.0, np.minimum(1.0, 2 * half / blur))
            lines = np.maximum(lines, np.maximum(share, 0.0))
        kept = self._kept(points)[:, None]
        floor = (1 - lines[:, None]) * np.array(_FLOOR) + lines[:, None] * np.array(_LINE)
        return np.asarray((1 - kept) * np.array(PAPER) + kept * floor)

    def _kept(self, points: Array) -> Array:
        away = np.linalg.norm(points[:, :2] - self._center, axis=1) / self._size
        share = np.clip((away - _FADE[0]) / (_FADE[1] - _FADE[0]), 0.0, 1.0)
        return np.asarray(1 - share * share * (3 - 2 * share))


@dataclass(frozen=True, eq=False)
class Shade:
    """Light on the ground in patches of `edge` [m] from `low` (2,) [m] on; 1 beyond them."""

    low: Array
    edge: float
    values: Array

    def at(self, points: Array) -> Array:
        """Light (K,) on points (K, 3) of the ground."""
        places = (points[:, :2] - self.low) / self.edge
        last = np.array(self.values.shape) - 1
        here = np.flatnonzero(((places >= 0) & (places <= last)).all(axis=1))
        found = np.ones(len(points))
        found[here] = map_coordinates(self.values, places[here].T, order=1)
        return found
