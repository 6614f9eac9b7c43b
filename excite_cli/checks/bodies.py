"""Links of a description that cannot be bodies, or whose masses cannot be meant.

A body has a positive mass, and moments of inertia about its centre that are positive, of which two
are at least as large as the third (I₁ + I₂ ≥ I₃): no density makes others.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np

from excite_cli.checks.base import DescriptionCheck, Log
from excite_cli.checks.check_result import CheckResult, Status
from excite_cli.robot.formats.base import origin_of
from excite_cli.robot.model import Array, Robot

# Mass, centre and inertia of every link, as the description writes them.

_TENSOR = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))


@dataclass(frozen=True)
class LinkBody:
    """One link, in its own frame and axes.

    mass [kg]; centre (3,) [m] of mass; inertia (3, 3) [kg·m²] about it; joints (K, 3) [m]: places
    of the joint that carries the link (the origin) and of those that it carries.
    """

    name: str
    mass: float
    centre: Array
    inertia: Array
    joints: Array

    @property
    def spread(self) -> Array:
        """Mean square ∫(x − c)(x − c)ᵀ dm / m (3, 3) [m²]: (tr I / 2 · 1 − I) / m."""
        second = np.trace(self.inertia) / 2 * np.eye(3) - self.inertia
        return np.asarray(second / self.mass)


def link_bodies(robot: Robot) -> list[LinkBody]:
    """Links with a mass and an inertia, in the order of the description."""
    root = ElementTree.fromstring(robot.description.xml)
    places: dict[str, list[Array]] = {}
    for joint in root.iter("joint"):
        parent = joint.find("parent")
        if parent is not None:
            place = np.array(origin_of(joint).translation)
            places.setdefault(parent.get("link", ""), []).append(place)
    found = []
    for link in root.iter("link"):
        name, inertial = link.get("name", ""), link.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        tensor = None if inertial is None else inertial.find("inertia")
        if inertial is None or mass is None or tensor is None:
            continue
        place = origin_of(inertial)
        turn = np.array(place.rotation)
        own = np.array([[float(tensor.get(key, 0.0)) for key in row] for row in _TENSOR])
        joints = np.vstack([np.zeros(3), *places.get(name, [])])
        kilograms, centre = float(mass.get("value", 0.0)), np.array(place.translation)
        found.append(LinkBody(name, kilograms, centre, turn @ own @ turn.T, joints))
    return found


NAME = "bodies of the description"
_ROUNDED = 0.02  # share by which rounded figures of a URDF may break the triangle's inequality
_DUST = 1e-5  # kg·m²: of a sensor's housing, which no torque shows
_LARGE = 5.0  # radius of gyration over the distance to the farthest joint of the link
_SHORTEST = 0.15  # m, of a link that carries no joint


def bodies_in_words(robot: Robot) -> str:
    """What to know of the description's bodies, in one sentence; empty where all can be."""
    return "; ".join(each.evidence for each in impossible_bodies(robot))


class ImpossibleBodies(DescriptionCheck):
    """Masses and moments of inertia that no body has."""

    name = NAME

    def look(self, log: Log) -> list[CheckResult]:
        """Of every link."""
        return impossible_bodies(log.robot)


def impossible_bodies(robot: Robot) -> list[CheckResult]:
    """A fault for links that no body is like; a doubt for those that hardly any is."""
    found = []
    for body in link_bodies(robot):
        moments: Array = np.linalg.eigvalsh(body.inertia).astype(float)
        if body.mass >= 0.0 and np.abs(moments).max() < _DUST:
            continue
        reach = max(_SHORTEST, float(np.linalg.norm(body.joints, axis=1).max()))
        said = _judged(body.mass, moments, reach)
        if said is not None:
            status, why = said
            text = f"{body.name} cannot be a body: {why}"
            if status == "doubt":
                text = f"{body.name} is hardly possible as a body: {why}"
            found.append(CheckResult(NAME, "impossible_body", status, text))
    return found


def _judged(mass: float, moments: Array, reach: float) -> tuple[Status, str] | None:
    told = ", ".join(f"{x:.3g}" for x in moments)
    if mass < 0.0:
        return "fault", f"its mass is {mass:.4g} kg. Correct it in the description"
    if mass == 0.0:
        return "doubt", (
            f"its moments of inertia are {told} kg·m², and its mass is 0. Give it one, or leave "
            "<inertial> out"
        )
    if moments[0] < -1e-9 - _ROUNDED * abs(moments[-1]):
        return "fault", (
            f"its moments of inertia are {told} kg·m² about its centre, and none may be negative. "
            "Correct them in the description"
        )
    if moments[0] + moments[1] < (1.0 - _ROUNDED) * moments[2] - 1e-9:
        return "doubt", (
            f"its principal moments {told} kg·m² violate the triangle inequality (any two must add "
            "up to the third). Wrong frame or unit"
        )
    gyration = float(np.sqrt(moments[-1] / mass)) if mass > 1e-3 else 0.0
    if gyration > _LARGE * reach:
        return "doubt", (
            f"moments of inertia of up to {moments[-1]:.3g} kg·m² with {mass:.3g} kg are those of "
            f"a body {2 * gyration:.2g} m wide; its joints span {reach:.2g} m. Are they in "
            "another unit (kg·mm²), or about another frame?"
        )
    return None
