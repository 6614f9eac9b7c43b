"""The family of formats: from a file's text to that of a URDF of the same robot."""

import xml.etree.ElementTree as ElementTree
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from excite_cli.arrays import Array, Indices
from excite_cli.robot.formats.kept_meshes import keep_mesh


@dataclass(frozen=True)
class ConversionRequest:
    """What a description is read with: folders of packages, and arguments of xacro.

    absent: packages that are nowhere, for which the one that the file lies in stands.
    """

    package_dirs: tuple[str, ...] = ()
    arguments: Mapping[str, object] = field(default_factory=dict)
    absent: tuple[str, ...] = ()


@dataclass(frozen=True)
class Urdf:
    """A URDF's text, with what was made for it and what it cannot hold.

    folders: further ones that its meshes lie in; notes: what was left out; meshes: files that were
    made in the cache; ignored: pairs of links whose contact the robot's author ruled out.
    """

    text: str
    folders: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    meshes: tuple[str, ...] = ()
    ignored: tuple[tuple[str, str], ...] = ()


class RobotFormat(ABC):
    """One way to describe a robot.

    `foreign`: it is read by a library that a file may lead astray, so in a process of its own.
    """

    name: str
    foreign: ClassVar[bool] = True

    @abstractmethod
    def recognises(self, path: Path, text: str) -> bool:
        """Whether a file with that text is of this format."""

    @abstractmethod
    def urdf(self, path: Path, text: str, asked: ConversionRequest) -> Urdf:
        """The same robot as a URDF.

        Raises
        ------
        RobotError
            The file is not what it seems to be, or holds what no URDF can.
        OutsideError
            It needs a file that it may not read.
        MissingExtraError
            The library that reads it is not installed.
        """

    def load_library(self) -> None:
        """Import what reads the format, before the process is confined.

        Raises
        ------
        MissingExtraError
            It is not installed.
        """
        return

    def sources(self, path: Path, text: str, asked: ConversionRequest) -> tuple[Path, ...] | None:
        """All files whose content decides what becomes of `path`; None where that is not known.

        Raises
        ------
        OutsideError
            The file names one that it may not read.
        """
        return None


# Parts of a URDF that is written from another format.

Element = ElementTree.Element

# Attributes of <inertia>, and where they stand in a tensor.
INERTIA_ENTRIES = (
    ("ixx", 0, 0),
    ("ixy", 0, 1),
    ("ixz", 0, 2),
    ("iyy", 1, 1),
    ("iyz", 1, 2),
    ("izz", 2, 2),
)
_BALL_POINTS = 200


def words(values: Array) -> str:
    """Numbers as an attribute holds them, to the last digit."""
    return " ".join(repr(float(value)) for value in values)


def origin_of(element: Element) -> pin.SE3:
    """Where an element's <origin> places it."""
    origin = element.find("origin")
    given = ("0 0 0" if origin is None else origin.get(key, "0 0 0") for key in ("xyz", "rpy"))
    xyz, rpy = (np.array([float(x) for x in text.split()]) for text in given)
    return pin.SE3(np.asarray(pin.rpy.rpyToMatrix(*rpy)), xyz)


def add_origin(element: Element, place: Array, turn: Array) -> None:
    """An <origin> at `place` (3,) [m], turned by `turn` (3, 3)."""
    figures = {"xyz": words(place), "rpy": words(pin.rpy.matrixToRpy(np.asarray(turn)))}
    ElementTree.SubElement(element, "origin", figures)


def add_inertial(link: Element, mass: float, place: Array, inertia: Array) -> None:
    """An <inertial> with its inertia (3, 3) [kg·m²] about `place` (3,) in the link's axes.

    Without angles, so that nothing of them is rounded.
    """
    inertial = ElementTree.SubElement(link, "inertial")
    add_origin(inertial, place, np.eye(3))
    ElementTree.SubElement(inertial, "mass", value=repr(mass))
    figures = {name: repr(float(inertia[i, j])) for name, i, j in INERTIA_ENTRIES}
    ElementTree.SubElement(inertial, "inertia", figures)


def add_shape(link: Element, kind: str, place: Array, turn: Array, shape: Element) -> Element:
    """A <collision> or <visual> with its shape."""
    item = ElementTree.SubElement(link, kind)
    add_origin(item, place, turn)
    ElementTree.SubElement(item, "geometry").append(shape)
    return item


def capsule(radius: float, length: float) -> Iterator[tuple[float, Element]]:
    """A cylinder and two balls, with their heights [m] along the capsule's axis."""
    figures = {"radius": repr(radius), "length": repr(length)}
    yield 0.0, ElementTree.Element("cylinder", figures)
    for side in (-0.5, 0.5):
        yield side * length, ElementTree.Element("sphere", radius=repr(radius))


def ellipsoid(radii: Array) -> tuple[Array, Indices]:
    """Corners (N, 3) [m] and triangles (F, 3) of an ellipsoid."""
    k = np.arange(_BALL_POINTS) + 0.5
    z, angle = 1 - 2 * k / _BALL_POINTS, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - z**2)
    points = radii * np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return points, ConvexHull(points).simplices.astype(np.intp)


def mesh(points: Array, faces: Indices, made: set[str]) -> Element:
    """A mesh as a file of the cache, whose path joins `made`."""
    path = keep_mesh(points, faces)
    made.add(str(path))
    return ElementTree.Element("mesh", filename=f"file://{path}")
