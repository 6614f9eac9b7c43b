"""What stands still while a motion is shown: the robot's bodies, its capsules, what is around it.

A `Scene` knows no time: `Instants` says where its bodies are at each instant.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.drawing import ConstraintScene, GroundRegion
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.obstacles import FLOOR, Box, Plane
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Array
from excite_cli.view.geometry import Body, Colour, robot_bodies
from excite_cli.view.surface import Surface, box_triangles, capsule_triangles, smooth_surface

PAYLOAD_COLOUR: Colour = (0.85, 0.55, 0.16)
_FEW = 24  # instants that tell how far a motion reaches


@dataclass(frozen=True, eq=False)
class GroundPolygon:
    """A convex part of the ground: corners (k, 2) in order [m] at `height` [m]."""

    corners: Array
    height: float


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything of a problem that can be shown, at rest.

    capsules: those that constraints look at, with a surface for each, in the frames of their
    joints. boxes: solid obstacles in the world, by name; walls: half-spaces other than the floor.
    region: what the centre of mass or the zero-moment point is kept in. contacts: (k, 3) points
    [m]. ground: height [m] at which the ground is drawn; ground_words: what it is; solid: whether
    it is a floor, or else only a plane that the robot may pass. low, high: (3,) corners of what the
    motions reach [m]; outline: (K, 3) outermost points of it [m]. note: what is
    not shown as one might expect.
    """

    name: str
    bodies: tuple[Body, ...]
    capsules: tuple[Capsule, ...]
    capsule_surfaces: tuple[Surface, ...]
    boxes: tuple[tuple[str, Surface], ...]
    walls: tuple[Plane, ...]
    region: GroundPolygon | None
    contacts: Array
    ground: float
    ground_words: str
    solid: bool
    low: Array
    high: Array
    outline: Array
    note: str = ""

    @property
    def center(self) -> Array:
        """(3,) [m]."""
        return np.asarray((self.low + self.high) / 2)

    @property
    def size(self) -> float:
        """Length [m] of the diagonal of what the motions reach."""
        return float(np.linalg.norm(self.high - self.low))


def build_scene(problem: Problem, paths: list[Array], cell: float = 0.0) -> Scene:
    """The scene of `problem`, as large as the positions (T, n) in `paths` ask for.

    cell: detail of meshes below this size [m] is dropped.
    """
    robot = problem.robot
    bodies, note = robot_bodies(robot, cell)
    if robot.payload is not None:
        carried = robot.payload.capsule
        surface = smooth_surface(capsule_triangles(carried.start, carried.end, carried.radius))
        bodies = (*bodies, Body(carried.name, carried.joint, surface, PAYLOAD_COLOUR))
    drawings = [constraint.drawing for constraint in problem.constraints]
    capsules, kept = _capsules(drawings), _main_region(drawings)
    obstacles = [obstacle for drawing in drawings for obstacle in drawing.obstacles]
    outline, foot = _reach(problem, bodies, paths)
    low, high = outline.min(axis=0), outline.max(axis=0)
    floor = next((o.offset for o in obstacles if isinstance(o, Plane) and o.name == FLOOR), None)
    solid = floor is not None or (kept is not None and kept.height is not None)
    ground, words = _ground(floor, kept.height if kept else None, foot, float(low[2]))
    boxes = tuple((o.name, _box_surface(o)) for o in obstacles if isinstance(o, Box))
    outline = np.vstack([outline, *(_corners(surface.points) for _, surface in boxes)])
    low, high = outline.min(axis=0), outline.max(axis=0)
    region, contacts = _region(kept, ground)
    return Scene(
        name=robot.name,
        bodies=bodies,
        capsules=capsules,
        capsule_surfaces=tuple(
            smooth_surface(capsule_triangles(c.start, c.end, c.radius), cell) for c in capsules
        ),
        boxes=boxes,
        walls=tuple(o for o in obstacles if isinstance(o, Plane) and o.name != FLOOR),
        region=region,
        contacts=contacts,
        ground=ground,
        ground_words=words,
        solid=solid,
        low=np.array([low[0], low[1], min(float(low[2]), ground)]),
        high=high,
        outline=outline,
        note=note,
    )


def _capsules(drawings: list[ConstraintScene]) -> tuple[Capsule, ...]:
    """Every capsule once; self-collision and surroundings share theirs."""
    found = {id(capsule): capsule for drawing in drawings for capsule in drawing.capsules}
    return tuple(found.values())


def _box_surface(box: Box) -> Surface:
    return smooth_surface(box_triangles(box.half)).moved(box.rotation, box.position)


def _reach(problem: Problem, bodies: tuple[Body, ...], paths: list[Array]) -> tuple[Array, float]:
    """Outermost points (K, 3) of all bodies along the paths, and the height of the base's foot."""
    found = []
    for q in paths:
        some = np.unique(np.linspace(0, len(q) - 1, min(_FEW, len(q))).astype(int))
        found.append(outermost(bodies, Poses.of(problem.robot, q[some])))
    points = np.vstack(found)
    if not len(points):
        points = np.array([[-1.0] * 3, [1.0] * 3])
    still = [body.surface.points[:, 2] for body in bodies if body.joint == 0]
    return points, min((float(z.min()) for z in still if len(z)), default=float("inf"))


def outermost(bodies: tuple[Body, ...], poses: Poses) -> Array:
    """Points (K, 3) of the bodies [m] that reach farthest at the given poses."""
    if not len(poses):
        return np.zeros((0, 3))
    found = [np.zeros((0, 3))]
    for body in bodies:
        if len(body.surface.points):
            points = poses.points(body.joint, _corners(body.surface.points))
            found.append(points.reshape(-1, 3) if body.joint else points[0])
    return np.vstack(found)


def _corners(points: Array) -> Array:
    """The points (k, 3) that are outermost in many directions."""
    angles = np.linspace(0, np.pi, 7)[:, None], np.linspace(0, 2 * np.pi, 13)[None, :-1]
    z, x, y = (
        np.cos(angles[0]) + 0 * angles[1],
        np.sin(angles[0]) * np.cos(angles[1]),
        np.sin(angles[0]) * np.sin(angles[1]),
    )
    directions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return np.asarray(points[np.unique((points @ directions.T).argmax(axis=0))])


def _ground(
    floor: float | None, height: float | None, foot: float, lowest: float
) -> tuple[float, str]:
    """Height [m] and what it is: the floor or the contact's, else the plane of the base's foot.

    A robot whose base has no shapes, or moves, has none of these: then the lowest point reached.
    """
    if floor is not None:
        return floor, f"floor at {floor:.3g} m"
    if height is not None:
        return height, f"ground at {height:.3g} m"
    if np.isfinite(foot):
        return foot, f"plane of the base at {foot:.3g} m, no floor is modelled"
    return lowest, f"lowest point at {lowest:.3g} m, no floor is modelled"


def _main_region(drawings: list[ConstraintScene]) -> GroundRegion | None:
    """The one at a height of its own, as a contact with the ground has it, before others."""
    found = [drawing.region for drawing in drawings if drawing.region is not None]
    return next((each for each in found if each.height is not None), found[0] if found else None)


def _region(kept: GroundRegion | None, ground: float) -> tuple[GroundPolygon | None, Array]:
    """As it is drawn, and the points of contact (k, 3)."""
    if kept is None:
        return None, np.zeros((0, 3))
    height = ground if kept.height is None else kept.height
    flat = np.zeros((0, 2)) if kept.contacts is None else kept.contacts
    contacts = np.column_stack([flat, np.full(len(flat), height)])
    return GroundPolygon(_polygon(kept.normals, kept.offsets), height), contacts


def _polygon(normals: Array, offsets: Array) -> Array:
    """Corners (m, 2) of the region normal·x ≤ offset, in order."""
    order = np.argsort(np.arctan2(normals[:, 1], normals[:, 0]))
    normals, offsets = normals[order], offsets[order]
    pairs = np.stack([normals, np.roll(normals, -1, axis=0)], axis=1)
    sides = np.stack([offsets, np.roll(offsets, -1)], axis=1)[..., None]
    return np.asarray(np.linalg.solve(pairs, sides)[..., 0])
