"""What one sees through: capsules, walls, the balance region, the robot at other instants."""

from dataclasses import dataclass

import numpy as np

from excite_cli.geometry.obstacles import Plane
from excite_cli.robot.model import Array
from excite_cli.view.geometry import Colour
from excite_cli.view.rays import Tracer
from excite_cli.view.scene import GroundPolygon, Scene
from excite_cli.view.surface import Surface

# Okabe and Ito, as in the figures of reports.
CAPSULE: Colour = (0.0, 0.447, 0.698)
NEAREST: Colour = (0.835, 0.369, 0.0)
REGION: Colour = (0.0, 0.62, 0.451)
GHOST: Colour = (0.45, 0.50, 0.58)
WALL: Colour = (0.45, 0.52, 0.62)
_LIFTED = 0.002  # [m] by which the region is drawn above the ground


@dataclass(frozen=True, eq=False)
class Pane:
    """Surfaces that cover what is behind them in part; only the first one on a ray is seen.

    colours (S, 3), one for each surface. face, rim: how much they cover where seen from straight
    ahead and from the side.
    """

    tracer: Tracer
    colours: Array
    face: float
    rim: float

    def cover(self, normals: Array, directions: Array) -> Array:
        """Share (K,) of what is behind that is covered."""
        facing = np.abs(np.einsum("kx,kx->k", normals, directions))
        return np.asarray(self.face + (self.rim - self.face) * (1 - facing) ** 2)


def region_pane(region: GroundPolygon) -> Pane:
    """The balance region on the ground."""
    return Pane(Tracer([region_surface(region)]), np.array([REGION]), 0.45, 0.45)


def region_surface(region: GroundPolygon) -> Surface:
    """The region as triangles about its middle."""
    corners = np.column_stack(
        [region.corners, np.full(len(region.corners), region.height + _LIFTED)]
    )
    count = len(corners)
    points = np.vstack([corners, corners.mean(axis=0)])
    here = np.arange(count)
    faces = np.column_stack([here, (here + 1) % count, np.full(count, count)])
    return Surface(points, np.tile([0.0, 0.0, 1.0], (count + 1, 1)), faces.astype(np.intp))


def wall_panes(scene: Scene) -> list[Pane]:
    """Every wall, as far as the scene goes."""
    if not scene.walls:
        return []
    surfaces = [wall_surface(wall, scene) for wall in scene.walls]
    return [Pane(Tracer(surfaces), np.array([WALL] * len(surfaces)), 0.13, 0.2)]


def wall_surface(wall: Plane, scene: Scene) -> Surface:
    """A rectangle of the plane beside the scene, from the ground to its top where it is upright."""
    normal = wall.normal
    middle = scene.center - (normal @ scene.center - wall.offset) * normal
    level = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(level) < 1e-3:
        level = np.array([1.0, 0.0, 0.0])
    level /= np.linalg.norm(level)
    rising = np.cross(normal, level)
    half = scene.size / 2
    low, high = -half, half
    if rising[2] > 0.1:
        low = (scene.ground - middle[2]) / rising[2]
        high = (scene.high[2] - middle[2]) / rising[2]
    points = np.array(
        [
            middle - half * level + low * rising,
            middle + half * level + low * rising,
            middle + half * level + high * rising,
            middle - half * level + high * rising,
        ]
    )
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.intp)
    return Surface(points, np.tile(normal, (4, 1)), faces)
