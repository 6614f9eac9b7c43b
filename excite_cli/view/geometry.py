"""What the robot looks like: the URDF's visual shapes, in the frames of the joints that carry them.

A visual mesh that is missing is left out. Where nothing of the URDF can be shown the collision
shapes are taken, and where there are none of these either, sticks between the joints.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from excite_cli.errors import RobotError
from excite_cli.geometry.link_shapes import collision_model, visual_model
from excite_cli.robot.model import Array, Robot
from excite_cli.view.surface import (
    Surface,
    Triangles,
    ball_profile,
    box_triangles,
    capsule_triangles,
    cylinder_triangles,
    hull_triangles,
    round_triangles,
    smooth_surface,
)

# What a robot looks like, as far as its meshes are there: one that is missing costs no other.


def readable_visuals(robot: Robot) -> tuple[pin.GeometryModel, dict[str, str]]:
    """The visual geometry that can be read, and why the rest of a link cannot, by link.

    Raises
    ------
    RobotError
        The URDF's visual shapes cannot be read whatever is left out.
    """
    try:
        return visual_model(robot), {}
    except RobotError:  # of which shapes it is true is found one by one
        root = ElementTree.fromstring(robot.description.xml)
    shapes = [(link, shape) for link in root.findall("link") for shape in link.findall("visual")]
    for link, shape in shapes:
        link.remove(shape)
    kept: list[tuple[ElementTree.Element, ElementTree.Element]] = []
    lacking: dict[str, str] = {}
    for link, shape in shapes:
        link.append(shape)
        try:
            visual_model(_described_by(root, robot))
            kept.append((link, shape))
        except RobotError as error:
            lacking.setdefault(link.get("name", ""), str(error))
        link.remove(shape)
    for link, shape in kept:
        link.append(shape)
    return visual_model(_described_by(root, robot)), lacking


def _described_by(root: ElementTree.Element, robot: Robot) -> Robot:
    xml = ElementTree.tostring(root, encoding="unicode")
    return replace(robot, description=replace(robot.description, xml=xml))


Colour = tuple[float, float, float]

# Links whose URDF gives no colour: light and dark in turn, so that one sees where one ends.
_LIGHT: Colour = (0.80, 0.81, 0.83)
_DARK: Colour = (0.42, 0.46, 0.53)
_STICK = 0.04  # radius of a stick as a share of its length
_THINNEST, _THICKEST = 0.004, 0.03  # [m]


@dataclass(frozen=True, eq=False)
class Body:
    """A part of the robot in one colour, in the frame of joint `joint` of `robot.model`.

    joint 0 is the world. colour: sRGB, each from 0 to 1.
    """

    name: str
    joint: int
    surface: Surface
    colour: Colour


def robot_bodies(robot: Robot, cell: float = 0.0) -> tuple[tuple[Body, ...], str]:
    """What to show of `robot`, and a note for people if that is not what the URDF shows.

    cell: detail below this size [m] is dropped.
    """
    model, note = _visuals(robot)
    if model is None or not model.geometryObjects:
        try:
            model = collision_model(robot)
        except RobotError as error:
            model, note = None, f"{error} Sticks between the joints are shown instead."
    if model is None or not model.geometryObjects:
        note = note or f"{robot.name} has neither visual nor collision shapes: sticks are shown."
        return _sticks(robot), note
    links: dict[str, None] = {}
    found = []
    for item in model.geometryObjects:
        link = str(robot.model.frames[item.parentFrame].name)
        links.setdefault(link)
        triangles = _triangles(item)
        if triangles is None or not len(triangles.faces):
            continue
        surface = smooth_surface(triangles, cell).moved(
            np.array(item.placement.rotation), np.array(item.placement.translation)
        )
        colour = _colour(item, list(links).index(link))
        found.append(Body(str(item.name), int(item.parentJoint), surface, colour))
    return tuple(found), note


def _visuals(robot: Robot) -> tuple[pin.GeometryModel | None, str]:
    """Visual shapes that can be read, and a note on the others."""
    try:
        model, lacking = readable_visuals(robot)
    except RobotError as error:
        return None, f"{error} The collision shapes are shown instead."
    if not lacking:
        return model, ""
    why = next(iter(lacking.values()))
    if not model.geometryObjects:
        return None, f"{why} The collision shapes are shown instead."
    are = "is" if len(lacking) == 1 else "are"
    return model, f"{', '.join(lacking)} {are} drawn without what cannot be read: {why}"


def in_bytes(colour: Colour) -> tuple[int, int, int]:
    """Each part from 0 to 255."""
    red, green, blue = (round(255 * x) for x in colour)
    return red, green, blue


def _colour(item: pin.GeometryObject, number: int) -> Colour:
    """That of the URDF's material, or light and dark in turn."""
    if item.overrideMaterial:
        red, green, blue = (float(x) for x in np.asarray(item.meshColor)[:3])
        return red, green, blue
    return _DARK if number % 2 else _LIGHT


def _triangles(item: pin.GeometryObject) -> Triangles | None:
    """Triangles in the frame of the shape; None for a kind that cannot be shown."""
    shape = item.geometry
    kind = type(shape).__name__
    if kind.startswith("BVHModel"):
        points = np.array(shape.vertices(), dtype=float).reshape(-1, 3)
        corners = [shape.tri_indices(k) for k in range(shape.num_tris)]
        faces = np.array([[one[0], one[1], one[2]] for one in corners], dtype=np.intp)
        if np.prod(np.asarray(item.meshScale).ravel()) < 0:  # a mirrored mesh is inside out
            faces = faces[:, ::-1]
        return Triangles(points, faces.reshape(-1, 3))
    if kind.startswith("Convex"):
        return hull_triangles(np.array(shape.points(), dtype=float).reshape(-1, 3))
    if kind == "Box":
        return box_triangles(np.asarray(shape.halfSide).ravel())
    if kind == "Sphere":
        return round_triangles(ball_profile(shape.radius, 0.0))
    if kind == "Ellipsoid":
        ball = round_triangles(ball_profile(1.0, 0.0))
        return Triangles(ball.points * np.asarray(shape.radii).ravel(), ball.faces)
    if kind == "Capsule":
        return round_triangles(ball_profile(shape.radius, shape.halfLength))
    if kind == "Cylinder":
        return cylinder_triangles(shape.radius, shape.halfLength)
    if kind == "Cone":
        return cylinder_triangles(shape.radius, shape.halfLength, 0.0)
    return None


def _sticks(robot: Robot) -> tuple[Body, ...]:
    """Capsules from every joint to those that it carries."""
    model = robot.model
    found = []
    for joint in range(1, model.njoints):
        place: Array = np.array(model.jointPlacements[joint].translation)
        length = float(np.linalg.norm(place))
        radius = float(np.clip(_STICK * length, _THINNEST, _THICKEST))
        surface = smooth_surface(capsule_triangles(np.zeros(3), place, radius))
        colour = _DARK if joint % 2 else _LIGHT
        found.append(Body(str(model.names[joint]), int(model.parents[joint]), surface, colour))
    return tuple(found)
