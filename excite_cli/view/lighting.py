"""Light on surfaces: a soft lamp over the camera's shoulder, and a sky that leaves shade in nooks.

Both are a fixed set of directions, the same for every point, so that pictures have no noise and
two renderings of one scene are equal.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.view.rays import Tracer
from excite_cli.view.surface import turn_to

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
