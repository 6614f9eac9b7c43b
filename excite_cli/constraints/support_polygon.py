"""A convex region of the ground as half-planes normal·x ≤ offset."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from excite_cli.constraints.base import Array
from excite_cli.errors import ConfigError


@dataclass(frozen=True)
class Support:
    """`normals` (m, 2) of unit length, outwards; `offsets` (m,) [m]; `center` (2,) within [m]."""

    normals: Array
    offsets: Array
    center: Array

    @property
    def scale(self) -> Array:
        """Distance (m,) [m] of the centre from each edge."""
        return np.asarray(self.offsets - self.normals @ self.center)

    @property
    def labels(self) -> tuple[str, ...]:
        """Every edge by the direction that it lies in."""
        degrees = np.degrees(np.arctan2(self.normals[:, 1], self.normals[:, 0])) % 360
        return tuple(f"towards {angle:.0f}°" for angle in degrees)


def support_polygon(vertices: Array, margin: float, where: str) -> Support:
    """Convex hull of `vertices` (k, 2), shrunk by `margin` [m] at every edge.

    `where`: the section of the config, for messages.

    Raises
    ------
    ConfigError
        The vertices lie on a line, or nothing is left inside the margin.
    """
    try:
        hull = ConvexHull(vertices)
    except QhullError as error:
        raise ConfigError(f"{where}.vertices: all points lie on a line.") from error
    edges = np.unique(hull.equations.round(12), axis=0)
    offsets = -edges[:, 2] - margin
    center = vertices[hull.vertices].mean(axis=0)
    if np.any(offsets - edges[:, :2] @ center <= 0):
        raise ConfigError(f"{where}: a margin of {margin:g} m leaves nothing of the polygon.")
    return Support(edges[:, :2], offsets, center)
