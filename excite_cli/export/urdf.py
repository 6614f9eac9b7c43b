"""The robot's URDF with identified inertias and friction; everything else is kept.

Identified are the bodies between moved joints: a link with all that is fixed to it or hangs on
locked joints. What changed of such a body is put on the link that its joint carries, in whose frame
the ten parameters are given, so that they simply add. If that link alone cannot take it (its mass
would be negative, or no mass distribution would have it), the whole body goes to it and the links
lumped with it lose their inertias. The payload of the config is no part of the robot: it is taken
off.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

import numpy as np

from excite_cli.dynamics.pseudo_inertia import smallest_eigenvalues
from excite_cli.dynamics.regressor import payload_parameters, standard_parameters
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
from excite_cli.robot.formats.base import INERTIA_ENTRIES
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.urdf_joints import link_at

_UNCHANGED = 1e-14


def holds(effect: Effect, values: Array) -> bool:
    """Whether <dynamics> has a place for the effect."""
    return bool(effect.urdf(values)) and bool((values >= 0.0).all())


def updated_urdf(robot: Robot, model: IdentifiedModel) -> ModelText:
    """The URDF's text with `model` in it, and what a URDF cannot hold.

    Raises
    ------
    RobotError
        A body of `model` has a mass that is not positive: no URDF can hold it.
    """
    builder = ElementTree.TreeBuilder(insert_comments=True)
    text = robot.description.urdf
    root = ElementTree.fromstring(text, ElementTree.XMLParser(target=builder))
    links = {link.get("name", ""): link for link in root.findall("link")}
    notes = []
    for body, carried in enumerate(_carriers(robot, root)):
        ten = slice(10 * body, 10 * body + 10)
        payload = payload_parameters(robot)[ten]
        old, new = standard_parameters(robot)[ten] - payload, np.asarray(model.phi[ten]) - payload
        if np.abs(new - old).max() <= _UNCHANGED * max(np.abs(old).max(), 1e-300):
            continue
        if new[0] <= 0:
            raise RobotError(
                f"The body of link '{carried}' was identified with a mass of {new[0]:.3g} kg"
                f"{' without its payload' if payload.any() else ''}, which no URDF can hold. "
                "Identify with identification.consistent: true."
            )
        note = _put(links, carried, _lumped(robot, root, carried), old, new)
        if note:
            notes.append(note)
    notes += _friction(robot, root, model)
    if robot.payload is not None:
        notes.append(f"the payload ({robot.payload.in_words}) is not in it: keep robot.payload")
    ElementTree.indent(root)
    body_text = ElementTree.tostring(root, encoding="unicode")
    return ModelText(f'<?xml version="1.0"?>\n{body_text}\n', tuple(notes))


def _carriers(robot: Robot, root: ElementTree.Element) -> list[str]:
    """For every body of φ the link whose frame is the body's."""
    child = {joint.get("name", ""): link_at(joint, "child") for joint in root.findall("joint")}
    children = set(child.values())
    base = next(
        link.get("name", "") for link in root.findall("link") if link.get("name") not in children
    )
    return [child.get(str(name), base) for name in robot.model.names[1:]]


def _lumped(robot: Robot, root: ElementTree.Element, carried: str) -> list[str]:
    """Links that move with `carried`, without itself: over fixed and locked joints."""
    found, left = [], [carried]
    moving = robot.tree.joint_names
    while left:
        link = left.pop()
        for joint in root.findall("joint"):
            if link_at(joint, "parent") == link and joint.get("name") not in moving:
                left.append(link_at(joint, "child"))
                found.append(left[-1])
    return found


def _put(
    links: dict[str, ElementTree.Element],
    carried: str,
    lumped: Sequence[str],
    old: Array,
    new: Array,
) -> str:
    """Write the inertia of the link `carried`; return what must be said about it."""
    heavy = [name for name in lumped if _ten_of(links[name]).any()]
    own = _ten_of(links[carried])
    wanted = own + new - old
    if not heavy:
        wanted = new
    elif wanted[0] <= 0 or smallest_eigenvalues(wanted, np.ones(1))[0] <= 0:
        for name in heavy:
            links[name].remove(_inertial(links[name]))
        wanted = new
        _write(links[carried], wanted)
        return (
            f"link '{carried}' now holds the whole body's inertia; {', '.join(heavy)}, which move "
            "with it, have lost theirs"
        )
    _write(links[carried], wanted)
    if heavy:
        return (
            f"link '{carried}' took what was identified for itself and {', '.join(heavy)}, which "
            "move with it; how it is shared among them does not show"
        )
    return ""


def _inertial(link: ElementTree.Element) -> ElementTree.Element:
    inertial = link.find("inertial")
    assert inertial is not None
    return inertial


def _ten_of(link: ElementTree.Element) -> Array:
    """Ten parameters of a link about its own frame; zeros without <inertial>."""
    inertial = link.find("inertial")
    if inertial is None:
        return np.zeros(10)
    origin, mass, inertia = (inertial.find(tag) for tag in ("origin", "mass", "inertia"))
    m = float(mass.get("value", "0")) if mass is not None else 0.0
    center, rotation = np.zeros(3), np.eye(3)
    if origin is not None:
        center = np.array([float(word) for word in origin.get("xyz", "0 0 0").split()])
        rotation = _rotation(*(float(word) for word in origin.get("rpy", "0 0 0").split()))
    about = np.zeros((3, 3))
    if inertia is not None:
        for name, row, column in INERTIA_ENTRIES:
            about[row, column] = about[column, row] = float(inertia.get(name, "0"))
    lever = center @ center * np.eye(3) - np.outer(center, center)
    full = rotation @ about @ rotation.T + m * lever
    moments = [full[0, 0], full[0, 1], full[1, 1], full[0, 2], full[1, 2], full[2, 2]]
    return np.concatenate([[m], m * center, moments])


def _rotation(roll: float, pitch: float, yaw: float) -> Array:
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _write(link: ElementTree.Element, ten: Array) -> None:
    mass, center, inertia = ten_as_body(ten)
    inertial = link.find("inertial")
    if inertial is None:
        inertial = ElementTree.Element("inertial")
        link.insert(0, inertial)
    for child in list(inertial):
        inertial.remove(child)
    ElementTree.SubElement(inertial, "origin", {"xyz": vector(center), "rpy": "0 0 0"})
    ElementTree.SubElement(inertial, "mass", {"value": number(mass)})
    entries = {name: number(inertia[row, column]) for name, row, column in INERTIA_ENTRIES}
    ElementTree.SubElement(inertial, "inertia", entries)


def _friction(robot: Robot, root: ElementTree.Element, model: IdentifiedModel) -> list[str]:
    """Write <dynamics> of every moved joint; return what did not fit in.

    Friction of joints that follow others was found at their drivers, and is written there.
    """
    held: dict[str, dict[str, float]] = {name: {} for name in robot.joint_names}
    left: list[Effect] = []
    for effect, values in model.by_effect:
        attributes = effect.urdf(values)
        if not attributes or effect.runs or len(effect.joints) != 1:
            left.append(effect)
            continue
        of_joint = held[robot.joint_names[effect.joints[0]]]
        for key, value in attributes.items():
            of_joint[key] = of_joint.get(key, 0.0) + value
    held |= {name: {} for of_joint in robot.followers for name in of_joint}
    for joint in root.findall("joint"):
        found = held.get(joint.get("name", ""))
        dynamics = joint.find("dynamics")
        if found is None or (not found and dynamics is None):
            continue
        if dynamics is None:
            dynamics = ElementTree.SubElement(joint, "dynamics")
        for key in ("damping", "friction"):  # the model that was fitted is all there is
            dynamics.set(key, number(found.get(key, 0.0)))
    if not left:
        return []
    words = in_words(left, robot.joint_names)
    return [f"a URDF cannot hold: {words}. The file of parameters does"]
