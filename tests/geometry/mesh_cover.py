"""Do capsules contain the meshes that they stand for?

A triangle lies in a capsule if its corners do (capsules are convex). One that lies in no single
capsule of its link is halved across its longest side until its parts do or are smaller than a
fraction of a millimetre; what is left there is measured corner by corner.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from excite_cli.geometry.link_meshes import LinkMesh, link_meshes
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]

TOLERANCE = 1e-6  # [m]
_SMALLEST = 1e-3  # [m] longest side of a triangle that is not halved any more
_PLAIN = 1e-3  # [m] what stands out so far needs no closer look


@dataclass(frozen=True)
class Uncovered:
    """A link whose collision geometry stands out of its capsules by `distance` [m]."""

    link: str
    distance: float


def uncovered_links(
    robot: Robot, capsules: tuple[Capsule, ...], tolerance: float = TOLERANCE
) -> tuple[Uncovered, ...]:
    """Links that stand out of all their capsules by more than `tolerance` [m].

    Links whose capsule is given by hand are asked too: it need not contain the link, but how much
    is left out is worth telling. Links without a capsule count with an infinite distance.
    """
    found = []
    for mesh in link_meshes(robot):
        own = [capsule for capsule in capsules if mesh.link in capsule.links]
        distance = _standing_out(mesh, own, tolerance) if own else np.inf
        if distance > tolerance:
            found.append(Uncovered(mesh.link, distance))
    return tuple(found)


def _standing_out(mesh: LinkMesh, capsules: list[Capsule], tolerance: float) -> float:
    """How far the surface stands out of the union of the capsules [m], at most 0 inside."""
    corners = _triangles(mesh)
    worst = -np.inf
    while len(corners):
        heights = np.stack([_heights(corners.reshape(-1, 3), one) for one in capsules])
        worst = max(worst, float(heights.min(axis=0).max()))
        if worst > _PLAIN:
            break
        heights = heights.reshape(len(capsules), -1, 3)
        corners = corners[(heights > tolerance).any(axis=2).all(axis=0)]
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        corners, longest = corners[sides.max(axis=1) > _SMALLEST], sides.argmax(axis=1)
        longest = longest[sides.max(axis=1) > _SMALLEST]
        rows = np.arange(len(corners))
        one, two = corners[rows, longest], corners[rows, (longest + 1) % 3]
        third, middle = corners[rows, (longest + 2) % 3], (one + two) / 2
        corners = np.concatenate(
            [np.stack([one, middle, third], axis=1), np.stack([middle, two, third], axis=1)]
        )
    return worst


def _heights(points: Array, capsule: Capsule) -> Array:
    """Distance of points (N, 3) to the surface of a capsule [m], negative inside."""
    along = capsule.end - capsule.start
    share = np.clip((points - capsule.start) @ along / max(float(along @ along), 1e-18), 0.0, 1.0)
    away = points - capsule.start - share[:, None] * along
    return np.asarray(np.linalg.norm(away, axis=1) - capsule.radius)


def _triangles(mesh: LinkMesh) -> Array:
    """Triangles (F, 3, 3) of a link's surface; primitives by polyhedra that contain them."""
    found = []
    for shape, turn, shift in mesh.parts:
        if type(shape).__name__.startswith("BVHModel"):
            bvh: pin.CollisionGeometry = shape
            points = np.array(bvh.vertices(), dtype=float).reshape(-1, 3)
            faces = [bvh.tri_indices(k) for k in range(bvh.num_tris)]
            chosen = np.array([[face[0], face[1], face[2]] for face in faces], dtype=np.intp)
            found.append((points @ turn.T + shift)[chosen])
    if len(found) < len(mesh.parts):
        found.append(mesh.hull[ConvexHull(mesh.hull).simplices])
    return np.concatenate(found)
