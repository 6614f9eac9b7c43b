"""Mass, centre and inertia of every link, as the description writes them."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np

from excite_cli.robot.formats.urdf_parts import origin_of
from excite_cli.robot.model import Array, Robot

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
