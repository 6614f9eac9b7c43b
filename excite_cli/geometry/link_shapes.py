"""The collision geometry of every link as corners and edges, in the frame of its joint.

What a capsule must contain is the convex hull of a link's corners. Round shapes are replaced by
polyhedra that *contain* them, so a capsule around the corners contains the true shape. Edges are
kept so that a shape can be cut by a plane: the corners on one side and the places where edges
cross it span all of the solid on that side.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.errors import RobotError
from excite_cli.geometry.capsule_fit import sphere_points
from excite_cli.robot.description import RobotDescription
from excite_cli.robot.mesh_paths import Kind, check_mesh_paths, located
from excite_cli.robot.model import Robot

_RIM = 32  # corners of a rim that stands for a circle
_BALL = 240  # corners of a polyhedron that stands for a sphere
_latest: tuple[tuple[pin.Model, RobotDescription, bool], pin.GeometryModel] | None = None


@dataclass(frozen=True)
class LinkShape:
    """Collision geometry of one link (or of several on the same joint).

    points: (N, 3) corners [m] in the joint frame; edges: (E, 2) indices of corners.
    joint: index in `robot.model`; 0 is fixed to the world.
    """

    links: tuple[str, ...]
    joint: int
    points: Array
    edges: Indices

    def joined(self, other: "LinkShape") -> "LinkShape":
        """Both shapes as one; they must belong to the same joint."""
        return LinkShape(
            self.links + other.links,
            self.joint,
            np.vstack([self.points, other.points]),
            np.vstack([self.edges, other.edges + len(self.points)]),
        )

    def halves(self, axis: Array, height: float) -> tuple["LinkShape", "LinkShape"]:
        """The parts below and above the plane `axis . x = height`, each with its edges."""
        return self._below(axis, height), self._below(-axis, -height)

    def cut(self, axis: Array, height: float) -> tuple[Array, Array]:
        """Points that span the shape below and above the plane `axis . x = height`."""
        above = self.points @ axis - height
        middle = self._crossings(above)[0]
        lower, upper = self.points[above <= 0], self.points[above >= 0]
        return np.vstack([lower, middle]), np.vstack([upper, middle])

    def _crossings(self, above: Array) -> tuple[Array, Mask]:
        first, second = self.edges.T
        crossing = above[first] * above[second] < 0
        first, second = first[crossing], second[crossing]
        share = (above[first] / (above[first] - above[second]))[:, None]
        return (1 - share) * self.points[first] + share * self.points[second], crossing

    def _below(self, axis: Array, height: float) -> "LinkShape":
        above = self.points @ axis - height
        middle, crossing = self._crossings(above)
        kept = above <= 0
        number = np.cumsum(kept) - 1
        whole = self.edges[kept[self.edges].all(axis=1)]
        ends = self.edges[crossing]
        lower = np.where(kept[ends[:, 0]], ends[:, 0], ends[:, 1])
        new = kept.sum() + np.arange(len(ends))
        points = np.vstack([self.points[kept], middle])
        # The new corners lie in the plane; the edges between them only matter to further cuts
        # across that plane, where those of its convex outline are enough.
        edges = np.vstack(
            [number[whole], np.column_stack([number[lower], new]), _outline(middle) + kept.sum()]
        )
        return LinkShape(self.links, self.joint, points, edges.astype(np.intp))


def _outline(points: Array) -> Indices:
    """Edges of the convex outline of points (N, 3) in a plane, as pairs of indices."""
    if len(points) < 3:
        return np.zeros((0, 2), dtype=np.intp)
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    try:
        return ConvexHull(centred @ axes[:2].T).simplices.astype(np.intp)
    except QhullError:  # all on one line
        along = centred @ axes[0]
        return np.array([[along.argmin(), along.argmax()]], dtype=np.intp)


def collision_model(robot: Robot) -> pin.GeometryModel:
    """Collision geometry of the URDF, attached to the joints of `robot.model`.

    It is shared, and not to be changed: a problem asks several times for that of one robot. With
    `robot.visual_shapes`, that of links without any is their visual geometry.

    Raises
    ------
    RobotError
        A mesh is missing, lies outside the robot's folders, or cannot be read.
    """
    global _latest
    asked = robot.model, robot.description, robot.visual_shapes
    if _latest is None or any(a is not b for a, b in zip(_latest[0], asked, strict=True)):
        advice = " Repair the mesh, or drop constraints.self_collision."
        geometry = _geometry(robot, "collision", pin.GeometryType.COLLISION, advice)
        if robot.visual_shapes:
            shown = visual_model(robot, advice)
            has = {item.parentFrame for item in geometry.geometryObjects}
            for item in shown.geometryObjects:
                if item.parentFrame not in has:
                    geometry.addGeometryObject(item)
        _latest = asked, geometry
    return _latest[1]


def visual_model(robot: Robot, advice: str = "") -> pin.GeometryModel:
    """Visual geometry of the URDF; otherwise as `collision_model`. `advice` ends its errors."""
    return _geometry(robot, "visual", pin.GeometryType.VISUAL, advice)


def _geometry(
    robot: Robot, kind: Kind, of_pin: pin.GeometryType, advice: str = ""
) -> pin.GeometryModel:
    described = robot.description
    check_mesh_paths(described, kind)
    try:
        return pin.buildGeomFromUrdfString(
            robot.model, located(described, kind), of_pin, None, list(described.package_dirs)
        )
    except (RuntimeError, ValueError) as error:
        first = (str(error).strip().splitlines() or ["no reason given"])[0]
        raise RobotError(
            f"{described.path.name}: the {kind} geometry cannot be loaded: {first}.{advice}"
        ) from error


def link_shapes(
    robot: Robot, geometry: pin.GeometryModel, joints: Collection[int] | None = None
) -> tuple[LinkShape, ...]:
    """One shape per link with collision geometry, ordered by joint; of some `joints` or of all."""
    shapes: dict[str, LinkShape] = {}
    for item, link, points in placed_shapes(robot, geometry):
        joint = int(item.parentJoint)
        if joints is not None and joint not in joints:
            continue
        shape = LinkShape((link,), joint, points, _edges(item.geometry, points))
        known = shapes.get(link)
        joined = known.joined(shape) if known is not None else shape
        shapes[link] = LinkShape((link,), joined.joint, joined.points, joined.edges)
    return tuple(sorted(shapes.values(), key=lambda shape: shape.joint))


def placed_shapes(
    robot: Robot, geometry: pin.GeometryModel
) -> Iterator[tuple[pin.GeometryObject, str, Array]]:
    """Every shape, its link, and its corners (N, 3) [m] in the frame of the joint."""
    for item in geometry.geometryObjects:
        link = str(robot.model.frames[item.parentFrame].name)
        points = _corners(item, robot)
        yield item, link, points @ item.placement.rotation.T + item.placement.translation


def _corners(item: pin.GeometryObject, robot: Robot) -> Array:
    shape = item.geometry
    kind = type(shape).__name__
    if kind.startswith("BVHModel"):  # Pinocchio has applied the mesh's scale
        return np.array(shape.vertices(), dtype=float).reshape(-1, 3)
    if kind.startswith("Convex"):
        return np.array(shape.points(), dtype=float).reshape(-1, 3)
    if kind == "Box":
        return np.array(list(product((-1.0, 1.0), repeat=3))) * np.asarray(shape.halfSide).ravel()
    if kind == "Sphere":
        return shape.radius * _ball()
    if kind == "Ellipsoid":
        return np.asarray(shape.radii).ravel() * _ball()
    if kind == "Capsule":
        tip = np.array([0.0, 0.0, shape.halfLength])
        return np.vstack([shape.radius * _ball() + tip, shape.radius * _ball() - tip])
    if kind in ("Cylinder", "Cone"):
        angle = 2 * np.pi * np.arange(_RIM) / _RIM
        reach = shape.radius / np.cos(np.pi / _RIM)
        rim = np.column_stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(_RIM)])
        tip = np.array([0.0, 0.0, shape.halfLength])
        return np.vstack([rim - tip, rim + tip if kind == "Cylinder" else tip])
    raise RobotError(
        f"{robot.description.path.name}: the collision shape '{item.name}' is of kind {kind}, "
        "which has no capsule. Use a mesh, box, cylinder or sphere in the URDF."
    )


def _edges(shape: object, points: Array) -> Indices:
    """Edges of a mesh's triangles; of any other shape those of its convex hull."""
    if type(shape).__name__.startswith("BVHModel"):
        bvh: pin.CollisionGeometry = shape
        faces = [bvh.tri_indices(k) for k in range(bvh.num_tris)]
        triangles = np.array([[face[0], face[1], face[2]] for face in faces], dtype=np.intp)
    else:
        try:
            triangles = ConvexHull(points).simplices.astype(np.intp)
        except QhullError:  # flat or a point: nothing to cut
            triangles = np.zeros((0, 3), dtype=np.intp)
    sides = triangles.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    sides = np.sort(sides, axis=1)
    return sides[np.unique(sides[:, 0] * len(points) + sides[:, 1], return_index=True)[1]]


def _ball() -> Array:
    """Corners (240, 3) of a polyhedron that contains the unit sphere."""
    points = sphere_points(_BALL)
    return points / -ConvexHull(points).equations[:, 3].max()
