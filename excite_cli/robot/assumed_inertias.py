"""Inertias for links whose author gave none: those of their shapes at one density.

Many descriptions are made for kinematics alone. Which motions show a robot's parameters depends on
no mass; torques, and a simulated robot, do. A link's shapes count by their convex hulls, which
overlap or are hollow in truth: the order of magnitude is right, and no more is claimed.
"""

import hashlib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import coal
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from excite_cli.arrays import Array
from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.robot.description import RobotDescription
from excite_cli.robot.formats.base import add_inertial, origin_of
from excite_cli.robot.mesh_paths import Kind, MeshFiles, unusable

Element = ElementTree.Element

_RIM = 32  # corners of a rim that stands for a circle


@dataclass(frozen=True)
class _Moments:
    """Volume [m³], first (3,) and second (3, 3) moments ∫ x dV and ∫ x xᵀ dV of a body."""

    volume: float
    first: Array
    second: Array

    def moved(self, turn: Array, shift: Array) -> "_Moments":
        """Those of the body turned, then shifted."""
        first = turn @ self.first
        cross = np.outer(first, shift)
        second = turn @ self.second @ turn.T + cross + cross.T
        return _Moments(
            self.volume,
            first + self.volume * shift,
            second + self.volume * np.outer(shift, shift),
        )

    def __add__(self, other: "_Moments") -> "_Moments":
        return _Moments(
            self.volume + other.volume, self.first + other.first, self.second + other.second
        )


def with_assumed_inertias(description: RobotDescription, density: float) -> RobotDescription:
    """The description with inertias at `density` [kg/m³] of links that have no mass.

    Collision shapes count, of links without any the visual ones; links whose shapes are missing or
    cannot be read stay without mass.
    """
    found: dict[str, _Moments] = {}
    files = MeshFiles(description)
    kinds: tuple[Kind, ...] = ("collision", "visual")
    lacking = {kind: unusable(description, kind) for kind in kinds}
    for link in ElementTree.fromstring(description.xml).findall("link"):
        name = link.get("name", "")
        mass = link.find("inertial/mass")
        if mass is not None and float(mass.get("value", "0")) > 0:
            continue
        usable = (kind for kind in kinds if link.find(kind) is not None)
        kind = next((kind for kind in usable if name not in lacking[kind]), None)
        moments = None if kind is None else _of_link(link, kind, files)
        if moments is not None and moments.volume > 0.0:
            found[name] = moments
    # The URDF is what exports start from.
    xml, urdf = (_given(text, found, density) for text in (description.xml, description.urdf))
    return replace(description, xml=xml, urdf=urdf)


def _given(text: str, found: dict[str, _Moments], density: float) -> str:
    """A URDF's text with an <inertial> for the links that were found."""
    root = ElementTree.fromstring(text)
    for link in root.findall("link"):
        if link.get("name", "") in found:
            _give(link, found[link.get("name", "")], density)
    return ElementTree.tostring(root, encoding="unicode")


def _of_link(link: Element, kind: Kind, files: MeshFiles) -> _Moments | None:
    total = None
    for item in link.findall(kind):
        place = origin_of(item)
        for shape in item.findall("geometry/*"):
            own = _of_shape(shape, files)
            if own is not None:
                own = own.moved(place.rotation, place.translation)
                total = own if total is None else total + own
    return total


def _give(link: Element, moments: _Moments, density: float) -> None:
    for old in link.findall("inertial"):
        link.remove(old)
    centre = moments.first / moments.volume
    second = density * (moments.second - moments.volume * np.outer(centre, centre))
    inertia = np.trace(second) * np.eye(3) - second
    add_inertial(link, float(density * moments.volume), centre, inertia)


def _of_shape(shape: Element, files: MeshFiles) -> _Moments | None:
    if shape.tag == "mesh":
        path = files.found(shape.get("filename", ""))
        scale = np.array([float(x) for x in shape.get("scale", "1 1 1").split()])
        return None if path is None else _of_mesh(path, scale)
    radius, length = float(shape.get("radius", "0")), float(shape.get("length", "0"))
    if shape.tag == "sphere":
        volume = 4 / 3 * np.pi * radius**3
        return _Moments(volume, np.zeros(3), volume * radius**2 / 5 * np.eye(3))
    if shape.tag == "box":
        half = np.array([float(x) / 2 for x in shape.get("size", "0 0 0").split()])
        return _of_points(half * np.array(list(product((-1.0, 1.0), repeat=3))))
    if shape.tag in ("cylinder", "capsule"):
        return _of_points(np.array(list(_rims(radius, length))))
    return None


def _rims(radius: float, length: float) -> Iterator[tuple[float, float, float]]:
    for k, side in product(range(_RIM), (-0.5, 0.5)):
        angle = 2 * np.pi * k / _RIM
        yield radius * np.cos(angle), radius * np.sin(angle), side * length


def _of_mesh(path: Path, scale: Array) -> _Moments | None:
    """Those of a mesh's hull; read once for its content."""
    with path.open("rb") as file:
        content = hashlib.file_digest(file, "sha256").hexdigest()
    key = hashlib.sha256(f"hull|{content}|{path.suffix}|{scale.tolist()}".encode()).hexdigest()
    arrays = stored_arrays(key)
    if arrays is None:
        loaded = coal.MeshLoader(coal.NODE_TYPE.BV_OBBRSS).load(str(path), scale)
        found = _of_points(np.array(loaded.vertices(), dtype=float).reshape(-1, 3))
        if found is None:
            return None
        arrays = {"volume": np.array(found.volume), "first": found.first, "second": found.second}
        store_arrays(key, arrays)
    return _Moments(float(arrays["volume"]), arrays["first"], arrays["second"])


def _of_points(points: Array) -> _Moments | None:
    """Those of the convex hull of points (N, 3); None where it is flat."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    middle = points[hull.vertices].mean(axis=0)
    # Tetrahedra from the middle to every triangle: with corners a, b, c seen from there,
    # ∫ x xᵀ dV = V/20 (a aᵀ + b bᵀ + c cᵀ + s sᵀ), s = a + b + c.
    corners = points[hull.simplices] - middle
    volumes = np.abs(np.linalg.det(corners)) / 6
    sums = corners.sum(axis=1)
    first = (volumes[:, None] * sums / 4).sum(axis=0)
    squares = np.einsum("tki,tkj->tij", corners, corners) + sums[:, :, None] * sums[:, None, :]
    second = (volumes[:, None, None] * squares / 20).sum(axis=0)
    return _Moments(float(volumes.sum()), first, second).moved(np.eye(3), middle)
