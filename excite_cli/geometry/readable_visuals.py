"""What a robot looks like, as far as its meshes are there: one that is missing costs no other."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pinocchio as pin

from excite_cli.errors import RobotError
from excite_cli.geometry.link_shapes import visual_model
from excite_cli.robot.model import Robot


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
