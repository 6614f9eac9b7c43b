"""A robot as a URDF of its moved bodies alone, for tools that move every joint they see.

What is locked or fixed is lumped into the body that carries it, at the posture of the config;
shapes are left out, and a continuous joint is a revolute one with wide limits, so that Pinocchio
and MuJoCo count one position for each joint. Bodies without mass have no <inertial>.
"""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Robot

_WIDE = "1000"


def plain_urdf(robot: Robot) -> str:
    """The text; links are called after the joint that carries them.

    Raises
    ------
    ValueError
        Joints follow others, or the base floats: not every tool here can hold that.
    """
    if robot.coupling is not None or robot.floating:
        raise ValueError(f"{robot.name}: joints that follow others, or a base that floats")
    model, root = robot.model, ElementTree.Element("robot", name=robot.name)
    ElementTree.SubElement(root, "link", name="base_link")
    own = {each.get("name"): each.find("dynamics")
           for each in ElementTree.fromstring(robot.description.xml).findall("joint")}  # fmt: skip
    for k in range(1, model.njoints):
        name, parent = str(model.names[k]), int(model.parents[k])
        above = f"{model.names[parent]}_link" if parent else "base_link"
        direction = np.asarray(model.joints[k].createData().S).ravel()
        sliding = bool(direction[:3].any())
        joint = ElementTree.SubElement(
            root, "joint", name=name, type="prismatic" if sliding else "revolute"
        )
        ElementTree.SubElement(joint, "parent", link=above)
        ElementTree.SubElement(joint, "child", link=f"{name}_link")
        joint.append(_origin(model.jointPlacements[k]))
        axis = direction[:3] if sliding else direction[3:]
        ElementTree.SubElement(joint, "axis", xyz=_words(axis))
        limits = {"lower": f"-{_WIDE}", "upper": _WIDE, "effort": _WIDE, "velocity": _WIDE}
        ElementTree.SubElement(joint, "limit", limits)
        if own.get(name) is not None:
            joint.append(own[name])
        link = ElementTree.SubElement(root, "link", name=f"{name}_link")
        if model.inertias[k].mass > 0.0:
            link.append(_inertial(model.inertias[k]))
    return ElementTree.tostring(root, encoding="unicode")


def _origin(placement: pin.SE3) -> ElementTree.Element:
    turn = pin.rpy.matrixToRpy(placement.rotation)
    return ElementTree.Element("origin", xyz=_words(placement.translation), rpy=_words(turn))


def _inertial(inertia: pin.Inertia) -> ElementTree.Element:
    found = ElementTree.Element("inertial")
    ElementTree.SubElement(found, "origin", xyz=_words(inertia.lever), rpy="0 0 0")
    ElementTree.SubElement(found, "mass", value=repr(float(inertia.mass)))
    at = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    told = {name: repr(float(inertia.inertia[place])) for name, place in at.items()}
    ElementTree.SubElement(found, "inertia", told)
    return found


def _words(numbers: np.ndarray) -> str:
    return " ".join(repr(float(each)) for each in numbers)
