"""Every link's collision meshes and primitives with what bounds them, and where they stand.

Forward kinematics is Pinocchio's own, one configuration after the other: what judges a motion at
the end shares no code with what planned it.
"""

from dataclasses import dataclass
from itertools import product

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

from excite_cli.arrays import Array, Indices
from excite_cli.geometry.capsule_fit import principal_axes
from excite_cli.geometry.link_shapes import collision_model, placed_shapes
from excite_cli.robot.model import Robot

Part = tuple[pin.CollisionGeometry, Array, Array]
# A problem asks several times for those of one robot, whose collision model is shared as well.
_latest: tuple[pin.GeometryModel, tuple["LinkMesh", ...]] | None = None


@dataclass(frozen=True, eq=False)
class LinkMesh:
    """Collision geometry of one link, in the frame of the joint that carries it.

    parts: geometry with its rotation (3, 3) and translation (3,) [m] in the joint frame.
    hull: (V, 3) corners of a convex polyhedron that contains all parts; box: (8, 3) corners of
    a box that does; center (3,), radius: of a ball that does; spine: (2, 3) ends of a segment
    through its length, a hint and no bound.
    """

    link: str
    joint: int
    parts: tuple[Part, ...]
    hull: Array
    box: Array
    center: Array
    radius: float
    spine: Array


def link_meshes(robot: Robot) -> tuple[LinkMesh, ...]:
    """One record per link with collision geometry, ordered by joint.

    Raises
    ------
    RobotError
        A mesh cannot be used.
    """
    global _latest
    geometry = collision_model(robot)
    if _latest is not None and _latest[0] is geometry:
        return _latest[1]
    found: dict[tuple[str, int], tuple[list[Part], list[Array]]] = {}
    for item, link, points in placed_shapes(robot, geometry):
        parts, corners = found.setdefault((link, int(item.parentJoint)), ([], []))
        place = (np.array(item.placement.rotation), np.array(item.placement.translation))
        parts.append((item.geometry, *place))
        corners.append(points)
    meshes = tuple(
        _mesh(link, joint, tuple(parts), np.vstack(corners))
        for (link, joint), (parts, corners) in sorted(found.items(), key=lambda one: one[0][1])
    )
    _latest = geometry, meshes
    return meshes


def _mesh(
    link: str,
    joint: int,
    parts: tuple[Part, ...],
    points: Array,
) -> LinkMesh:
    try:
        hull = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):  # flat, or a few points
        hull = np.unique(points, axis=0)
    low, high = hull.min(axis=0), hull.max(axis=0)
    box = np.array(list(product(*zip(low, high, strict=True))))
    center = (low + high) / 2
    axis = principal_axes(hull)[0]
    along, across = (hull - center) @ axis, (hull - center) - np.outer((hull - center) @ axis, axis)
    inside = float(np.linalg.norm(across, axis=1).max())
    ends = [min(along.min() + inside, 0.0), max(along.max() - inside, 0.0)]
    return LinkMesh(
        link=link,
        joint=joint,
        parts=parts,
        hull=hull,
        box=box,
        center=center,
        radius=float(np.linalg.norm(hull - center, axis=1).max()),
        spine=center + np.outer(ends, axis),
    )


class Poses:
    """Where all joints of a robot stand at some instants, by Pinocchio.

    rotations (T, J, 3, 3), translations (T, J, 3) [m] of the joints of `robot.model`, 0 being the
    world.
    """

    def __init__(self, rotations: Array, translations: Array) -> None:
        self.rotations, self.translations = rotations, translations

    @classmethod
    def of(cls, robot: Robot, q: Array) -> "Poses":
        """The poses at moved-joint positions q (T, n)."""
        model = robot.model
        data = model.createData()
        configurations = robot.configurations(np.asarray(q, dtype=float).reshape(-1, robot.n))
        # Views into Pinocchio's data, so that an instant costs one copy.
        turns = [data.oMi[joint].rotation for joint in range(model.njoints)]
        places = [data.oMi[joint].translation for joint in range(model.njoints)]
        rotations = np.empty((len(configurations), model.njoints, 3, 3))
        translations = np.empty((len(configurations), model.njoints, 3))
        for t, configuration in enumerate(configurations):
            pin.forwardKinematics(model, data, configuration)
            rotations[t], translations[t] = turns, places
        return cls(rotations, translations)

    def at(self, instants: Indices) -> "Poses":
        """Those at some of the instants."""
        return Poses(self.rotations[instants], self.translations[instants])

    def __len__(self) -> int:
        return len(self.rotations)

    def points(self, joint: int, local: Array) -> Array:
        """Points (..., 3) of a joint's frame in the world at all instants, (T, ..., 3)."""
        turned = np.tensordot(self.rotations[:, joint], local, axes=(2, local.ndim - 1))
        turned = np.moveaxis(turned, 1, -1)
        shift = self.translations[:, joint].reshape((-1,) + (1,) * (local.ndim - 1) + (3,))
        return np.asarray(turned + shift)

    def transform(self, instant: int, joint: int, turn: Array, shift: Array) -> coal.Transform3s:
        """Placement in the world of what stands at (turn, shift) in a joint's frame."""
        rotation = self.rotations[instant, joint]
        return coal.Transform3s(
            rotation @ turn, rotation @ shift + self.translations[instant, joint]
        )
