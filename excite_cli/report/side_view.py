"""From where drawings of the robot are seen: from far away, a little from above and the side."""

import numpy as np

from excite_cli.robot.model import Array

_AZIMUTH, _ELEVATION = np.radians(35.0), np.radians(18.0)


def side_view(points: Array) -> tuple[Array, Array]:
    """Across and down (..., 2) [m] of points (..., 3) [m], and how near they are (...) [m]."""
    c, s = np.cos(_AZIMUTH), np.sin(_AZIMUTH)
    towards = points @ np.array([c, s, 0.0])
    across = points @ np.array([-s, c, 0.0])
    up = points[..., 2] * np.cos(_ELEVATION) - towards * np.sin(_ELEVATION)
    near = towards * np.cos(_ELEVATION) + points[..., 2] * np.sin(_ELEVATION)
    return np.stack([across, -up], axis=-1), np.asarray(near)
