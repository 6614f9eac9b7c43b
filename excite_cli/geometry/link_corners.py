"""Corners of all shapes of every link, collision and visual ones, in the frame of the link."""

from dataclasses import replace

import numpy as np

from excite_cli.errors import RobotError
from excite_cli.geometry.link_shapes import collision_model, placed_shapes, visual_model
from excite_cli.robot.mesh_paths import unusable, without_unusable
from excite_cli.robot.model import Array, Robot


def link_corners(robot: Robot) -> dict[str, Array]:
    """Corners (N, 3) [m] by the link's name; none of meshes that are missing or cannot be read."""
    described = robot.description
    lacking = {**unusable(described, "collision"), **unusable(described, "visual")}
    usable = replace(robot, description=without_unusable(described, tuple(lacking)))
    found: dict[str, list[Array]] = {}
    for of_kind in (collision_model, visual_model):
        try:
            geometry = of_kind(usable)
            for item, link, points in placed_shapes(usable, geometry):
                frame = robot.model.frames[item.parentFrame].placement
                own = (points - np.array(frame.translation)) @ np.array(frame.rotation)
                found.setdefault(link, []).append(own)
        except RobotError:  # a shape of another kind: what was read so far counts
            continue
    return {link: np.vstack(points) for link, points in found.items()}
