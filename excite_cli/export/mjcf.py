"""A MuJoCo model (MJCF) of the moved joints with identified inertias and joint effects.

The kinematic tree, one body per moved joint, no shapes and no actuators: MuJoCo's inverse dynamics
of it gives the identified torque. A floating base stands at its reference.
"""

import xml.etree.ElementTree as ElementTree

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.errors import RobotError
from excite_cli.export.exported import (
    ModelText,
    in_words,
    number,
    ten_as_body,
    vector,
)
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import Tree, TreeJoint, tree_of

_ADDED = ("damping", "frictionloss", "armature")


def mjcf(robot: Robot, model: IdentifiedModel) -> ModelText:
    """The model's text, and what MJCF cannot hold.

    Raises
    ------
    RobotError
        A body has inertias that MuJoCo refuses, since no mass distribution has them.
    """
    tree = tree_of(robot)
    attributes, left = _joint_attributes(robot, model)
    root = ElementTree.Element("mujoco", {"model": robot.name})
    ElementTree.SubElement(root, "compiler", {"angle": "radian", "autolimits": "false"})
    ElementTree.SubElement(root, "option", {"gravity": vector(tree.gravity)})
    world = ElementTree.SubElement(root, "worldbody")
    placed: list[ElementTree.Element] = []
    for j, joint in enumerate(tree.joints):
        parent = world if joint.parent < 0 else placed[joint.parent]
        body = _body(parent, joint, model.phi[_ten(tree, j)])
        limits = _limits(robot, j)
        kind = "slide" if joint.sliding else "hinge"
        settings = {"name": joint.name, "type": kind, "axis": vector(joint.axis), **limits}
        settings.update({key: number(value) for key, value in attributes[j].items()})
        joint_element = ElementTree.Element("joint", settings)
        body.insert(1, joint_element)
        placed.append(body)
    ElementTree.indent(root)
    notes = ["shapes, actuators and sensors are not in it"]
    if robot.payload is not None:
        notes.append(f"the payload ({robot.payload.in_words}) is part of its body")
    if left:
        words = in_words(left, robot.joint_names)
        notes.append(f"MJCF cannot hold: {words}. The file of parameters does")
    return ModelText(ElementTree.tostring(root, encoding="unicode") + "\n", tuple(notes))


def _ten(tree: Tree, j: int) -> slice:
    first = 10 * (tree.first_body + j)
    return slice(first, first + 10)


def _body(parent: ElementTree.Element, joint: TreeJoint, ten: Array) -> ElementTree.Element:
    mass, center, inertia = ten_as_body(ten)
    moments = np.linalg.eigvalsh(inertia)
    if mass <= 0 or moments[0] <= 0 or moments[0] + moments[1] < moments[2]:
        raise RobotError(
            f"The body carried by '{joint.name}' (mass {mass:.3g} kg, principal moments "
            f"{', '.join(f'{moment:.3g}' for moment in moments)} kg·m²) is not one that MuJoCo "
            "accepts. Identify with identification.consistent: true."
        )
    place = {"pos": vector(joint.position), "quat": vector(_quaternion(joint.rotation))}
    body = ElementTree.SubElement(parent, "body", {"name": f"body_of_{joint.name}", **place})
    entries = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2]]
    ElementTree.SubElement(
        body,
        "inertial",
        {
            "pos": vector(center),
            "mass": number(mass),
            "fullinertia": vector(np.array([*entries, inertia[1, 2]])),
        },
    )
    return body


def _quaternion(rotation: Array) -> Array:
    """w, x, y, z of a rotation matrix."""
    values, vectors = np.linalg.eigh(_quaternion_form(rotation))
    found = vectors[:, int(np.argmax(values))]
    return found if found[0] >= 0 else -found


def _quaternion_form(r: Array) -> Array:
    """4×4 symmetric matrix whose dominant eigenvector is the quaternion (Bar-Itzhack 2000)."""
    return np.array(
        [
            [np.trace(r), r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )


def _limits(robot: Robot, j: int) -> dict[str, str]:
    lower, upper = float(robot.limits.lower[j]), float(robot.limits.upper[j])
    if not (np.isfinite(lower) and np.isfinite(upper)):
        return {}
    return {"limited": "true", "range": f"{number(lower)} {number(upper)}"}


def _joint_attributes(
    robot: Robot, model: IdentifiedModel
) -> tuple[list[dict[str, float]], list[Effect]]:
    """Attributes of every joint's <joint>, and the effects that have no place there."""
    attributes: list[dict[str, float]] = [{} for _ in range(robot.n)]
    left: list[Effect] = []
    for effect, values in model.by_effect:
        found = effect.mjcf(values)
        of_joint = attributes[effect.joints[0]]
        clash = any(key in of_joint and key not in _ADDED for key in found)
        negative = any(found[key] < 0 for key in _ADDED if key in found)
        if not found or effect.runs or len(effect.joints) != 1 or clash or negative:
            left.append(effect)
            continue
        for key, value in found.items():
            of_joint[key] = of_joint.get(key, 0.0) + value if key in _ADDED else value
    return attributes, left
