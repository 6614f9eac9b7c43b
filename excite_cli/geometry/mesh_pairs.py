"""Distance of the true meshes of one pair of links, and which pairs of a robot to ask about."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from dataclasses import dataclass

import coal
import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.link_meshes import LinkMesh, Part, Poses
from excite_cli.geometry.reasons import ContactMeaning
from excite_cli.robot.carried_bodies import MovedBodies
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]

_TOUCH = 1e-9  # [m]
_FAR = 1e3  # [m] farther than any robot reaches


@dataclass(frozen=True)
class MeshPair:
    """Two links that can move relative to each other.

    first, second: indices into the links. standing: whether their meshes must stay
    apart, else why they are only told.
    """

    first: int
    second: int
    standing: ContactMeaning = ContactMeaning.JUDGED

    @property
    def judged(self) -> bool:
        """Whether contact of this pair breaks a motion."""
        return self.standing is ContactMeaning.JUDGED


class PairMeshes:
    """The meshes of two links, asked by coal one instant at a time."""

    def __init__(self, first: LinkMesh, second: LinkMesh) -> None:
        self.meshes = (first, second)
        self._request, self._answer = coal.DistanceRequest(), coal.DistanceResult()
        self._touch, self._touched = coal.CollisionRequest(), coal.CollisionResult()
        self._touch.enable_contact = False
        # coal's functors keep no geometry alive; the links do.
        self._parts = [
            (one, other, coal.ComputeDistance(one[0], other[0]))
            for one in first.parts
            for other in second.parts
        ]
        self._nearest: tuple[Array, Array] | None = None

    def distance(self, poses: Poses, instant: int, below: float = np.inf) -> float:
        """Distance of the meshes [m], or `below` where it is not less.

        Where they touch it is 0, or less for primitives: some depth, not the greatest. A cap saves
        most of the work, since coal leaves out what is farther than the least distance it has
        found. The points that were nearest when last asked give one: they are on the meshes, so
        that the distance is at most theirs, and between instants that follow each other hardly
        less.
        """
        least, apart = min(below, _FAR), self._last_nearest(poses, instant)
        least = min(least, apart)
        for one, two, compute in self._parts:
            self._answer.clear()
            self._answer.min_distance = max(least, _TOUCH)
            placed = self._placed(poses, instant, one, two)
            compute(*placed, self._request, self._answer)
            if self._answer.min_distance < least:
                least = self._answer.min_distance
                self._nearest = self._witness(poses, instant, least)
        return least

    def _last_nearest(self, poses: Poses, instant: int) -> float:
        """Distance [m] now of the points that were nearest before; infinite without any."""
        if self._nearest is None:
            return np.inf
        first, second = (
            poses.rotations[instant, mesh.joint] @ point + poses.translations[instant, mesh.joint]
            for mesh, point in zip(self.meshes, self._nearest, strict=True)
        )
        return float(np.linalg.norm(second - first)) + _TOUCH

    def _witness(self, poses: Poses, instant: int, distance: float) -> tuple[Array, Array] | None:
        """The nearest points in the frames of their joints, if coal's lie at that distance."""
        points = self._answer.getNearestPoint1(), self._answer.getNearestPoint2()
        if not abs(float(np.linalg.norm(points[1] - points[0])) - distance) < _TOUCH:
            return None
        first, second = (
            (point - poses.translations[instant, mesh.joint]) @ poses.rotations[instant, mesh.joint]
            for mesh, point in zip(self.meshes, points, strict=True)
        )
        return first, second

    def touch(self, poses: Poses, instant: int) -> bool:
        """Whether the meshes touch; quicker than a distance."""
        for one, two, _ in self._parts:
            self._touched.clear()
            placed = self._placed(poses, instant, one, two)
            if coal.collide(one[0], placed[0], two[0], placed[1], self._touch, self._touched):
                return True
        return False

    def _placed(
        self, poses: Poses, instant: int, one: Part, two: Part
    ) -> tuple[coal.Transform3s, coal.Transform3s]:
        first, second = self.meshes
        return (
            poses.transform(instant, first.joint, *one[1:]),
            poses.transform(instant, second.joint, *two[1:]),
        )


def movable_pairs(
    robot: Robot, meshes: tuple[LinkMesh, ...], ignore: Iterable[tuple[str, str]] = ()
) -> list[tuple[int, int]]:
    """Pairs of links that some moved joint moves against each other.

    Left out are links that a joint of the URDF joins directly and pairs in `ignore`.
    """
    moved = MovedBodies(robot)
    left_out = {frozenset(pair) for pair in ignore} | joined_links(robot)
    pairs = []
    for i, first in enumerate(meshes):
        for j, second in enumerate(meshes[i + 1 :], i + 1):
            moving = len(moved.between(first.joint, second.joint)) > 0
            if moving and frozenset((first.link, second.link)) not in left_out:
                pairs.append((i, j))
    return pairs


def joined_links(robot: Robot) -> set[frozenset[str]]:
    """Pairs of links that a joint of the URDF joins directly."""
    pairs = set()
    for joint in ElementTree.fromstring(robot.description.xml).findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            pairs.add(frozenset((parent.get("link", ""), child.get("link", ""))))
    return pairs
