"""Links of a description that cannot be bodies, or whose masses cannot be meant.

A body has a positive mass, and moments of inertia about its centre that are positive, of which two
are at least as large as the third (I₁ + I₂ ≥ I₃): no density makes others.
"""

import xml.etree.ElementTree as ElementTree

import numpy as np

from excite_cli.checks.result import Result, Status
from excite_cli.robot.model import Array, Robot

NAME = "bodies of the description"
_ROUNDED = 0.02  # share by which rounded figures of a URDF may break the triangle's inequality
_DUST = 1e-5  # kg·m²: of a sensor's housing, which no torque shows
_LARGE = 5.0  # radius of gyration over the distance to the farthest joint of the link
_SHORTEST = 0.15  # m, of a link that carries no joint
_TENSOR = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))


def bodies_in_words(robot: Robot) -> str:
    """What to know of the description's bodies, in one sentence; empty where all can be."""
    return "; ".join(each.evidence for each in impossible_bodies(robot))


def impossible_bodies(robot: Robot) -> list[Result]:
    """A fault for links that no body is like; a doubt for those that hardly any is."""
    root = ElementTree.fromstring(robot.description.xml)
    found = []
    for link in root.iter("link"):
        inertial = link.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        tensor = None if inertial is None else inertial.find("inertia")
        if mass is None or tensor is None:
            continue
        kilograms = float(mass.get("value", 0.0))
        moments: Array = np.linalg.eigvalsh(_tensor(tensor)).astype(float)
        if kilograms >= 0.0 and np.abs(moments).max() < _DUST:
            continue
        said = _judged(kilograms, moments, _reach(root, str(link.get("name"))))
        if said is not None:
            status, why = said
            text = f"{link.get('name')} cannot be a body: {why}"
            if status == "doubt":
                text = f"{link.get('name')} is hardly a body: {why}"
            found.append(Result(NAME, "impossible_body", status, text))
    return found


def _judged(mass: float, moments: Array, reach: float) -> tuple[Status, str] | None:
    told = ", ".join(f"{x:.3g}" for x in moments)
    if mass < 0.0:
        return "fault", f"its mass is {mass:.4g} kg. Correct it in the description"
    if moments[0] < -1e-9 - _ROUNDED * abs(moments[-1]):
        return "fault", (
            f"its moments of inertia are {told} kg·m² about its centre, and none may be negative. "
            "Correct them in the description"
        )
    if moments[0] + moments[1] < (1.0 - _ROUNDED) * moments[2] - 1e-9:
        return "doubt", (
            f"its moments of inertia are {told} kg·m² about its centre, of which no two may be "
            "less than the third. Are they about another frame, or another unit?"
        )
    gyration = float(np.sqrt(moments[-1] / mass)) if mass > 1e-3 else 0.0
    if gyration > _LARGE * reach:
        return "doubt", (
            f"moments of inertia of up to {moments[-1]:.3g} kg·m² with {mass:.3g} kg are those of "
            f"a body {2 * gyration:.2g} m wide; its joints are {reach:.2g} m apart. Are they in "
            "another unit (kg·mm²), or about another frame?"
        )
    return None


def _tensor(element: ElementTree.Element) -> Array:
    return np.array([[float(element.get(key, 0.0)) for key in row] for row in _TENSOR])


def _reach(root: ElementTree.Element, name: str) -> float:
    """Distance [m] from a link's frame to the farthest joint that it carries."""
    found = _SHORTEST
    for joint in root.iter("joint"):
        parent, origin = joint.find("parent"), joint.find("origin")
        if parent is not None and parent.get("link") == name and origin is not None:
            place = [float(x) for x in origin.get("xyz", "0 0 0").split()]
            found = max(found, float(np.linalg.norm(place)))
    return found
