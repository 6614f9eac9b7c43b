"""Which two bodies are nearest at each instant, and the points between which they are."""

from collections.abc import Callable, Sequence

import numpy as np

from excite_cli.arrays import Array
from excite_cli.constraints.drawing import NearestBodies
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.obstacles import Obstacle
from excite_cli.geometry.world_segments import nearest_points, normals
from excite_cli.robot.capsule import Capsule

Ends = tuple[Array, Array]
Pairs = Sequence[tuple[int, int]]


def nearest_capsules(
    poses: Poses,
    distances: Array,
    labels: Sequence[str],
    capsules: Sequence[Capsule],
    pairs: Pairs,
) -> NearestBodies:
    """Of pairs of capsules by their indices, with their distances (T, P) [m] at the poses."""

    def ends(instant: int, column: int) -> Ends:
        one, other = (capsules[index] for index in pairs[column])
        start, along = _axis(poses, one, instant)
        far, far_along = _axis(poses, other, instant)
        near = nearest_points(start, along, far, far_along)
        normal = normals(near, along, far_along)[:, 0]
        first = start[:, 0] + float(near.share_first[0]) * along[:, 0]
        second = first + near.gap[:, 0]
        return first + one.radius * normal, second - other.radius * normal

    bodies = [(capsules[i], capsules[j]) for i, j in pairs]
    return _nearest(distances, labels, bodies, ends)


def nearest_obstacles(
    poses: Poses,
    distances: Array,
    labels: Sequence[str],
    capsules: Sequence[Capsule],
    obstacles: Sequence[Obstacle],
    pairs: Pairs,
) -> NearestBodies:
    """Of pairs (capsule, obstacle) by their indices, with their distances (T, P) [m]."""

    def ends(instant: int, column: int) -> Ends:
        capsule, obstacle = capsules[pairs[column][0]], obstacles[pairs[column][1]]
        start, along = _axis(poses, capsule, instant)
        contact = obstacle.contacts(start, along)
        normal = contact.normal[:, 0]
        on_axis = start[:, 0] + float(contact.share[0]) * along[:, 0]
        return on_axis - capsule.radius * normal, on_axis - float(contact.distance[0]) * normal

    return _nearest(distances, labels, [(capsules[i],) for i, _ in pairs], ends)


def _nearest(
    distances: Array,
    labels: Sequence[str],
    bodies: Sequence[tuple[Capsule, ...]],
    ends: Callable[[int, int], Ends],
) -> NearestBodies:
    columns = distances.argmin(axis=1).tolist()
    return NearestBodies(
        distances[np.arange(len(distances)), columns],
        np.array([ends(t, column) for t, column in enumerate(columns)]).reshape(-1, 2, 3),
        tuple(bodies[column] for column in columns),
        tuple(labels[column] for column in columns),
    )


def _axis(poses: Poses, capsule: Capsule, instant: int) -> tuple[Array, Array]:
    """Start and the vector to the end (3, 1) of a capsule's axis in the world."""
    rotation = poses.rotations[instant, capsule.joint]
    start = rotation @ capsule.start + poses.translations[instant, capsule.joint]
    return start[:, None], (rotation @ (capsule.end - capsule.start))[:, None]
