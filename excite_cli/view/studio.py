"""A scene at an instant as a picture: shaded bodies on a grid, with what is translucent over them.

One ray for each pixel finds where edges are; there more rays smooth them. Everything is computed
on the processor (see `rays`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.link_meshes import Poses
from excite_cli.robot.model import Array
from excite_cli.view.geometry import Colour
from excite_cli.view.ground import PAPER, GroundPlane, Shade
from excite_cli.view.rays import Camera, Hits, Tracer
from excite_cli.view.scene import Scene
from excite_cli.view.surface import Surface, turn_to
from excite_cli.view.translucent import GHOST, Pane, region_pane, wall_panes

# Light on surfaces: a soft lamp over the camera's shoulder, and a sky that leaves shade in nooks.
#
# Both are a fixed set of directions, the same for every point, so that pictures have no noise and
# two renderings of one scene are equal.

_LAMP, _SKY = 0.62, 0.38  # shares of the light on an open, level surface
_LAMP_ASIDE, _LAMP_RISE = np.radians(-38.0), np.radians(52.0)
_LAMP_WIDTH = np.radians(7.0)
_BOUNCE = 0.22  # light that comes back from the ground, on what faces down
_GLOSS, _SHARPNESS = 0.10, 40
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class Lights:
    """Directions (L, 3) towards lights, and the light (L,) of each on what faces it.

    lamp (3,): towards the middle of the lamp.
    """

    directions: Array
    strengths: Array
    lamp: Array

    @classmethod
    def beside(cls, azimuth: float, lamp_rays: int, sky_rays: int) -> "Lights":
        """Lights for a camera at `azimuth` [°]; more rays make softer shadows."""
        turn = np.radians(azimuth) + _LAMP_ASIDE
        lamp = np.array(
            [
                np.cos(_LAMP_RISE) * np.cos(turn),
                np.cos(_LAMP_RISE) * np.sin(turn),
                np.sin(_LAMP_RISE),
            ]
        )
        k = np.arange(lamp_rays)
        wide = np.sin(_LAMP_WIDTH) * np.sqrt((k + 0.5) / lamp_rays)
        disc = np.column_stack(
            [wide * np.cos(k * _GOLDEN), wide * np.sin(k * _GOLDEN), np.sqrt(1 - wide**2)]
        )
        of_lamp = disc @ turn_to(lamp).T
        k = np.arange(sky_rays)
        height = np.sqrt((k + 0.5) / sky_rays)  # as many as count equally on what is level
        flat = np.sqrt(1 - height**2)
        sky = np.column_stack([flat * np.cos(k * _GOLDEN), flat * np.sin(k * _GOLDEN), height])
        strengths = np.concatenate(
            [
                np.full(lamp_rays, _LAMP) / of_lamp[:, 2].sum(),
                np.full(sky_rays, _SKY) / max(float(sky[:, 2].sum()), 1e-9),
            ]
        )
        return cls(np.vstack([of_lamp, sky]), strengths, lamp)

    def on(self, points: Array, normals: Array, blockers: Sequence[Tracer], lift: float) -> Array:
        """Light (K,) on points (K, 3) with normals; 1 on what is level and open.

        lift: how far [m] rays start off the surface.
        """
        found = _BOUNCE * (1 - normals[:, 2]) / 2
        starts = points + lift * normals
        for direction, strength in zip(self.directions, self.strengths, strict=True):
            facing = normals @ direction
            lit = np.flatnonzero(facing > 0)
            for tracer in blockers:
                lit = lit[~tracer.blocked(starts[lit], direction)]
            found[lit] += strength * facing[lit]
        return np.asarray(found)

    def gloss(self, normals: Array, views: Array) -> Array:
        """Highlight (K,) of the lamp; views (K, 3) from the camera."""
        half = self.lamp - views
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        facing = np.clip(np.einsum("kx,kx->k", normals, half), 0.0, 1.0)
        return np.asarray(_GLOSS * facing**_SHARPNESS)


BOX_COLOUR: Colour = (0.86, 0.80, 0.70)
_ALIKE = 0.995  # cosine of normals that are lit alike
_FOLD = 0.88  # cosine of normals of neighbouring pixels below which there is an edge
_STEPS = 8192  # of light that colours tell apart
_STEP = 0.03  # share of the distance by which neighbouring pixels differ at an edge
# Places within a pixel [1/16], one in each row and column of a grid.
_PLACES = {
    4: np.array([[2, 6], [6, 14], [10, 2], [14, 10]]),
    8: np.array([[3, 11], [7, 5], [11, 15], [15, 9], [1, 1], [5, 13], [9, 7], [13, 3]]),
}


@dataclass(frozen=True)
class Quality:
    """Rays for each pixel on an edge (4 or 8), towards the lamp and the sky; patches of shade.

    lift: how far such rays start off a surface, as a share of the scene: more for coarse meshes.
    """

    edge_rays: int = 8
    lamp_rays: int = 10
    sky_rays: int = 28
    patches: int = 200
    lift: float = 1e-4


FINE, QUICK = Quality(), Quality(4, 3, 5, 72, 1e-3)


class Studio:
    """Renders `scene` for one camera; what stands still is prepared once.

    `panes` are shown besides those of the scene (walls, the balance region).
    """

    def __init__(
        self, scene: Scene, camera: Camera, azimuth: float, quality: Quality = FINE
    ) -> None:
        self._scene, self._camera, self._quality = scene, camera, quality
        self._lights = Lights.beside(azimuth, quality.lamp_rays, quality.sky_rays)
        self._ground = GroundPlane(scene)
        self._moving = [body for body in scene.bodies if body.joint != 0]
        still = [body for body in scene.bodies if body.joint == 0]
        self._still = Tracer([*(b.surface for b in still), *(box for _, box in scene.boxes)])
        colours = [*(b.colour for b in still), *(BOX_COLOUR for _ in scene.boxes)]
        self._first_moving = len(colours)
        colours += [body.colour for body in self._moving]
        self._albedo = _linear(np.array(colours, dtype=float).reshape(-1, 3))
        self._panes = wall_panes(scene)
        if scene.region is not None:
            self._panes.append(region_pane(scene.region))
        self._lift = quality.lift * scene.size

    def picture(
        self,
        poses: Poses,
        instant: int,
        capsules: Sequence[tuple[int, Colour]] = (),
        ghosts: Poses | None = None,
    ) -> NDArray[np.uint8]:
        """The scene at an instant of `poses`, (height, width, 3).

        capsules: indices and colours of those to be shown; ghosts: where else the robot is shown,
        faintly.
        """
        shown = self._placed(poses, instant)
        moving = Tracer(shown, self._first_moving)
        panes = [*self._panes]
        if capsules:
            surfaces = self._capsule_surfaces(poses, instant, capsules)
            colours = np.array([colour for _, colour in capsules])
            panes.append(Pane(Tracer(surfaces), colours, 0.07, 0.5))
            shown = [*shown, *surfaces]
        if ghosts is not None and len(ghosts):
            bodies = [one for t in range(len(ghosts)) for one in self._placed(ghosts, t)]
            panes.append(Pane(Tracer(bodies), np.array([GHOST] * len(bodies)), 0.16, 0.5))
            shown = [*shown, *bodies]
        width, height = self._camera.width, self._camera.height
        view = _Instant(moving, panes, self._shade(moving))
        colour, keys = self._of_ground(view.shade)
        near = np.flatnonzero(self._near(shown))
        colour[near], keys[near], light = self._seen(view, self._whole.part(near))
        at = np.flatnonzero(_edges(keys, height, width))
        y, x = np.divmod(at, width)
        lit = np.full(width * height, np.nan)
        lit[near] = light
        places = _PLACES[self._quality.edge_rays] / 16
        total = np.zeros((len(at), 3))
        for across, down in places:
            total += self._seen(view, self._sight(x + across, y + down), keys[at], lit[at])[0]
        colour[at] = total / len(places)
        return _bytes(colour).reshape(height, width, 3)

    def _shade(self, moving: Tracer) -> Shade:
        blockers = (self._still, moving)
        patches = self._quality.patches
        return self._ground.shade(
            patches, lambda points, up: self._lights.on(points, up, blockers, self._lift)
        )

    @cached_property
    def _whole(self) -> "_Sight":
        """Through the middle of every pixel."""
        width, height = self._camera.width, self._camera.height
        y, x = np.divmod(np.arange(width * height), width)
        return self._sight(x + 0.5, y + 0.5)

    @cached_property
    def _bare(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Pixels of the ground where nothing stands on it, its places, and what tells edges."""
        below = self._whole.below
        ground = np.flatnonzero(np.isfinite(below))
        keys = np.zeros((len(below), 6))
        keys[:, 0], keys[:, 5] = np.where(np.isfinite(below), -2, -1), 1.0
        places = self._camera.eye + below[ground, None] * self._whole.directions[ground]
        return ground, places, keys

    def _of_ground(self, shade: Shade) -> tuple[Array, Array]:
        """Linear colours, and what tells edges, of all pixels if only the ground were there."""
        ground, places, keys = self._bare
        colour = self._whole.paint.copy()
        colour[ground] *= shade.at(places)[:, None]
        return colour, keys.copy()

    @cached_property
    def _standing(self) -> NDArray[np.bool_]:
        """Pixels (height·width,) where something that never moves is."""
        whole = self._whole
        origins = np.broadcast_to(self._camera.eye, whole.directions.shape)
        panes = [pane.tracer.first_hits(origins, whole.directions) for pane in self._panes]
        return np.any([np.isfinite(each.distance) for each in (whole.still, *panes)], axis=0)

    def _near(self, shown: Sequence[Surface]) -> NDArray[np.bool_]:
        """Pixels (height·width,) where something other than the ground may be seen."""
        width, height = self._camera.width, self._camera.height
        found = self._standing.reshape(height, width).copy()
        for one in shown:
            if len(one.points):
                places = self._camera.project(one.points)
                low = np.maximum(np.floor(places.min(axis=0)).astype(int) - 1, 0)
                high = np.maximum(np.ceil(places.max(axis=0)).astype(int) + 1, 0)
                found[low[1] : high[1], low[0] : high[0]] = True
        return found.ravel()

    def _sight(self, x: Array, y: Array) -> "_Sight":
        directions = self._camera.rays(x, y)
        origins = np.broadcast_to(self._camera.eye, directions.shape)
        still = self._still.first_hits(origins, directions)
        below = self._ground.distances(origins, directions)
        on_ground = np.flatnonzero(below < still.distance)
        way = below[on_ground]
        places = origins[on_ground] + way[:, None] * directions[on_ground]
        paint = np.tile(_linear(np.array(PAPER)), (len(x), 1))
        paint[on_ground] = _linear(
            self._ground.colours(places, way / self._camera.focal, directions[on_ground])
        )
        return _Sight(directions, still, below, paint)

    def _placed(self, poses: Poses, instant: int) -> list[Surface]:
        return [
            body.surface.moved(
                poses.rotations[instant, body.joint], poses.translations[instant, body.joint]
            )
            for body in self._moving
        ]

    def _capsule_surfaces(
        self, poses: Poses, instant: int, capsules: Sequence[tuple[int, Colour]]
    ) -> list[Surface]:
        surfaces = []
        for index, _ in capsules:
            joint = self._scene.capsules[index].joint
            surface = self._scene.capsule_surfaces[index]
            place = poses.rotations[instant, joint], poses.translations[instant, joint]
            surfaces.append(surface.moved(*place))
        return surfaces

    def _seen(
        self,
        view: "_Instant",
        sight: "_Sight",
        middle: Array | None = None,
        lit: Array | None = None,
    ) -> tuple[Array, Array, Array]:
        """Linear colours (K, 3), what tells edges (K, 6), and light (K,) on what is no ground.

        In the middle of the same pixels: what tells edges (K, 6), and the light (K,) that is taken
        from there where a ray meets the same surface at nearly the same angle.
        """
        eye, directions = self._camera.eye, sight.directions
        origins = np.broadcast_to(eye, directions.shape)
        hits = _nearer(sight.still, view.moving.first_hits(origins, directions))
        below = sight.below
        if not self._scene.solid:  # what is below a plane that is no floor is seen through it
            below = np.where(np.isfinite(hits.distance), np.inf, below)
        colour = sight.paint.copy()
        on_ground = np.flatnonzero(below < hits.distance)
        places = eye + below[on_ground, None] * directions[on_ground]
        colour[on_ground] *= view.shade.at(places)[:, None]
        met = np.flatnonzero(hits.distance < below)
        blockers = (self._still, view.moving)
        light = np.full(len(directions), np.nan)
        if middle is not None and lit is not None:
            angle = np.einsum("kx,kx->k", hits.normal, middle[:, 3:])
            light = np.where((hits.part == middle[:, 0]) & (angle > _ALIKE), lit, np.nan)
        new = met[np.isnan(light[met])]
        starts = eye + hits.distance[new, None] * directions[new]
        light[new] = self._lights.on(starts, hits.normal[new], blockers, self._lift)
        shine = self._lights.gloss(hits.normal[met], directions[met])
        colour[met] = (self._albedo[hits.part[met]] + shine[:, None]) * light[met, None]
        seen = np.minimum(hits.distance, below)
        layers = np.zeros(len(seen))
        for pane in view.panes:
            found = pane.tracer.first_hits(origins, directions)
            front = np.flatnonzero(found.distance < seen * 1.001)
            alpha = pane.cover(found.normal[front], directions[front])[:, None]
            tint = _linear(pane.colours[found.part[front]])
            colour[front] = (1 - alpha) * colour[front] + alpha * tint
            layers[front] = layers[front] * 64 + found.part[front] + 1
        solid = hits.distance < below
        keys = np.empty((len(seen), 6))
        keys[:, 0] = np.where(solid, hits.part, np.where(np.isfinite(below), -2, -1))
        keys[:, 1], keys[:, 2] = layers, np.where(solid, seen, 0.0)
        keys[:, 3:] = np.where(solid[:, None], hits.normal, [0.0, 0.0, 1.0])
        return colour, keys, light


@dataclass(frozen=True, eq=False)
class _Sight:
    """What K rays of the camera meet that never moves: bodies, the ground and its paint (K, 3)."""

    directions: Array
    still: Hits
    below: Array
    paint: Array

    def part(self, at: NDArray[np.intp]) -> "_Sight":
        """Those of some rays."""
        still = Hits(self.still.distance[at], self.still.part[at], self.still.normal[at])
        return _Sight(self.directions[at], still, self.below[at], self.paint[at])


@dataclass(frozen=True, eq=False)
class _Instant:
    """What is there at one instant only."""

    moving: Tracer
    panes: Sequence[Pane]
    shade: Shade


def _nearer(first: Hits, second: Hits) -> Hits:
    closer = second.distance < first.distance
    return Hits(
        np.where(closer, second.distance, first.distance),
        np.where(closer, second.part, first.part),
        np.where(closer[:, None], second.normal, first.normal),
    )


def _edges(keys: Array, height: int, width: int) -> NDArray[np.bool_]:
    """Pixels (height·width,) that differ from one beside them."""
    part, layer, depth = (keys[:, k].reshape(height, width) for k in range(3))
    normal = keys[:, 3:].reshape(height, width, 3)
    found = np.zeros((height, width), dtype=bool)
    for one, other in (
        ((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
        ((slice(1, None), slice(None)), (slice(None, -1), slice(None))),
    ):
        differ = (part[one] != part[other]) | (layer[one] != layer[other])
        y, x = np.nonzero(~differ & (part[one] >= 0))  # elsewhere a level plane, or an edge already
        bend = np.einsum("kx,kx->k", normal[one][y, x], normal[other][y, x])
        differ[y, x] |= bend < _FOLD
        differ |= np.abs(depth[one] - depth[other]) > _STEP * depth[one]
        found[one] |= differ
        found[other] |= differ
    return found.ravel()


def _linear(colour: Array) -> Array:
    """From sRGB to light, both from 0 to 1."""
    return np.asarray(
        np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    )


def _curve() -> NDArray[np.uint8]:
    light = np.linspace(0.0, 1.0, _STEPS + 1)
    colour = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(255 * colour).astype(np.uint8)


_SRGB = _curve()


def _bytes(light: Array) -> NDArray[np.uint8]:
    """From light to sRGB."""
    return _SRGB[(np.clip(light, 0.0, 1.0) * _STEPS + 0.5).astype(np.int32)]
