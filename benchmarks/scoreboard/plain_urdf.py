"""The URDF of a config for tools that move every joint they see: the others become fixed.

Joints that stand are fixed at the posture of the config, shapes are left out, and a continuous joint
is a revolute one with wide limits: Pinocchio and MuJoCo then count one position for each joint.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin

_WIDE = "1000"


def plain_urdf(xml: str, moved: Sequence[str], posture: Mapping[str, float]) -> str:
    """The text with `moved` joints only; `posture` of the others [rad, m], 0 where not named."""
    root = ElementTree.fromstring(xml)
    for child in list(root):
        if child.tag not in ("link", "joint"):
            root.remove(child)
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    for joint in root.findall("joint"):
        name = joint.get("name", "")
        if name not in moved and joint.get("type") != "fixed":
            _fix(joint, posture.get(name, 0.0))
        elif joint.get("type") == "continuous":
            joint.set("type", "revolute")
            _wide(joint)
    return ElementTree.tostring(root, encoding="unicode")


def _fix(joint: ElementTree.Element, position: float) -> None:
    origin, axis = joint.find("origin"), joint.find("axis")
    direction = np.array([1.0, 0.0, 0.0] if axis is None else _numbers(axis, "xyz"))
    placed = pin.SE3.Identity()
    if origin is not None:
        placed = pin.SE3(pin.rpy.rpyToMatrix(*_numbers(origin, "rpy")), _column(origin))
    sliding = joint.get("type") == "prismatic"
    turn = pin.SE3.Identity()
    if sliding:
        turn.translation = direction * position
    else:
        turn.rotation = pin.AngleAxis(position, direction).matrix()
    whole = placed * turn
    for tag in ("axis", "limit", "dynamics", "mimic", "safety_controller", "calibration"):
        for each in joint.findall(tag):
            joint.remove(each)
    if origin is None:
        origin = ElementTree.SubElement(joint, "origin")
    origin.set("xyz", " ".join(map(repr, map(float, whole.translation))))
    origin.set("rpy", " ".join(map(repr, map(float, pin.rpy.matrixToRpy(whole.rotation)))))
    joint.set("type", "fixed")


def _wide(joint: ElementTree.Element) -> None:
    limit = joint.find("limit")
    if limit is None:
        limit = ElementTree.SubElement(joint, "limit", effort=_WIDE, velocity=_WIDE)
    limit.set("lower", f"-{_WIDE}")
    limit.set("upper", _WIDE)


def _numbers(element: ElementTree.Element, name: str) -> list[float]:
    return [float(each) for each in (element.get(name) or "0 0 0").split()]


def _column(origin: ElementTree.Element) -> np.ndarray:
    return np.array(_numbers(origin, "xyz"))
