"""Distance of the true meshes of one pair of links, its bounds, and which pairs to ask about."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import coal
import numpy as np

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.geometry.link_meshes import LinkMesh, Part, Poses
from excite_cli.geometry.reasons import ContactMeaning
from excite_cli.geometry.world_segments import nearest_points
from excite_cli.kernels.compiled import KERNELS
from excite_cli.robot.link_frame import MovedBodies
from excite_cli.robot.model import Robot

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


@dataclass(frozen=True, eq=False)
class PairTable:
    """Distance [m] of the meshes of two links over two moved joints.

    joints: the two moved joints; grids: positions of each; values: distances at all of them;
    error: the most by which the table was found to exceed the true distance at trial postures
    [m]; touching: share of the grid in contact; turning: which of the two joints turn without end.
    """

    first: str
    second: str
    joints: tuple[int, int]
    grids: tuple[Array, Array]
    values: Array
    error: float
    touching: float
    turning: tuple[bool, bool] = (False, False)

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import RectBivariateSpline  # few robots need a table

        return RectBivariateSpline(*self.grids, self.values, kx=3, ky=3)

    @cached_property
    def _slope_splines(self) -> tuple[Any, Any]:
        return self._spline.partial_derivative(1, 0), self._spline.partial_derivative(0, 1)

    def distances(self, q: Array) -> Array:
        """Distances (T,) [m], cut off at 0.02 m, at q (T, n)."""
        if KERNELS is not None:
            return self._value_and_slopes(q)[:, 0]
        return np.asarray(self._spline.ev(*self._at(q)))

    def slopes(self, q: Array) -> Array:
        """Derivatives (T, 2) by the two joints."""
        if KERNELS is not None:
            return self._value_and_slopes(q)[:, 1:]
        at = self._at(q)
        return np.stack([spline(*at, grid=False) for spline in self._slope_splines], axis=1)

    def _value_and_slopes(self, q: Array) -> Array:
        assert KERNELS is not None
        first, second, coefficients = self._knots_and_coefficients
        at = np.ascontiguousarray(self.positions(q), dtype=float)
        found = np.empty((len(at), 3))
        KERNELS.call("bicubic", first, second, coefficients, at, found)
        return found

    @cached_property
    def _knots_and_coefficients(self) -> tuple[Array, Array, Array]:
        first, second, coefficients = (np.ascontiguousarray(part) for part in self._spline.tck)
        return first, second, coefficients.reshape(len(first) - 4, len(second) - 4)

    def holds(self, at: Array) -> Mask:
        """Whether positions (T, 2) of the two joints are within the table (T,)."""
        low, high = (np.array([grid[end] for grid in self.grids]) for end in (0, -1))
        inside = (at >= low) & (at <= high)
        if not np.ptp(self.values, axis=1).any():  # the second joint changes nothing
            inside[:, 1] = True
        return np.asarray(inside.all(axis=1))

    def positions(self, q: Array) -> Array:
        """Positions (T, 2) of the two joints, within one turn where they turn without end."""
        at = q[:, list(self.joints)]
        if not any(self.turning):
            return at
        wrapped = np.mod(at + np.pi, 2 * np.pi) - np.pi
        return np.where(self.turning, wrapped, at)

    @cached_property
    def bends(self) -> tuple[float, float, float]:
        """Bounds on |second derivatives|: by one joint, by both, by the other.

        A spline is nowhere beyond its coefficients.
        """
        found = [self._spline.partial_derivative(*by) for by in ((2, 0), (1, 1), (0, 2))]
        one, both, other = (float(np.abs(spline.tck[2]).max()) for spline in found)
        return one, both, other

    def _at(self, q: Array) -> tuple[Array, Array]:
        one, two = (
            np.clip(at, grid[0], grid[-1])
            for at, grid in zip(self.positions(q).T, self.grids, strict=True)
        )
        return one, two


# Lower bounds of the distance of two convex hulls at many instants at once.
#
# For any unit vector u, all of B lies at least  min_B u·x − max_A u·x  beyond A: a proof whatever
# u is, and only its sharpness depends on u. Gilbert's iteration finds a good one: v is a point of
# B − A, w the corner of B − A that is lowest along u = v/|v| (so u·w is the bound), and the next
# v is the point of the segment from v to w that is nearest to the origin.

_STEPS = 8
_CROSSED = 1e-9  # [m] hulls nearer than this have no direction between them


def ball_bounds(poses: Poses, meshes: tuple[LinkMesh, ...], pairs: Indices) -> Array:
    """Lower bounds (P, T) [m] of the distance of pairs (P, 2) of links, from balls around them."""
    if not len(pairs):
        return np.zeros((0, len(poses)))
    centers = [np.ascontiguousarray(poses.points(m.joint, m.center).T) for m in meshes]
    found = np.empty((len(pairs), len(poses)))
    for bounds, (first, second) in zip(found, pairs.tolist(), strict=True):
        x, y, z = centers[first] - centers[second]
        np.sqrt(x * x + y * y + z * z, out=bounds)
        bounds -= meshes[first].radius + meshes[second].radius
    return found


def hull_bounds(
    poses: Poses, pair: tuple[LinkMesh, LinkMesh], instants: Indices, enough: Array
) -> Array:
    """Lower bounds (K,) [m] of the distance of two links' hulls at `instants` (K,).

    A bound is improved until it exceeds `enough` (K,) [m]; hulls that cross have one below zero.
    """
    one, two = (
        (poses.rotations[instants, mesh.joint], poses.translations[instants, mesh.joint])
        for mesh in pair
    )
    place = _first_guess(pair, one, two)
    bounds = np.full(len(instants), -np.inf)
    going = np.arange(len(instants))
    for _ in range(_STEPS):
        length = np.sqrt(np.einsum("kx,kx->k", place, place))
        keep = length > _CROSSED
        going, place, length = going[keep], place[keep], length[keep]
        if not len(going):
            break
        u = place / length[:, None]
        first, second = _support(pair[0], one, going, u), _support(pair[1], two, going, -u)
        corner = second - first
        found = np.einsum("kx,kx->k", u, corner)
        bounds[going] = np.maximum(bounds[going], found)
        keep = bounds[going] <= enough[going]
        going, place, corner = going[keep], place[keep], corner[keep]
        step = corner - place
        size = np.maximum(np.einsum("kx,kx->k", step, step), 1e-18)
        share = np.clip(-np.einsum("kx,kx->k", place, step) / size, 0.0, 1.0)
        place = place + share[:, None] * step
    return bounds


def _first_guess(
    pair: tuple[LinkMesh, LinkMesh], one: tuple[Array, Array], two: tuple[Array, Array]
) -> Array:
    """From the first link to the second (K, 3) between the nearest points of their spines."""
    ends = []
    for mesh, (rotations, translations) in zip(pair, (one, two), strict=True):
        start = rotations @ mesh.spine[0] + translations
        ends += [start.T, (rotations @ (mesh.spine[1] - mesh.spine[0])).T]
    gap = nearest_points(*ends).gap.T
    centers = [r @ mesh.center + p for mesh, (r, p) in zip(pair, (one, two), strict=True)]
    crossed = np.einsum("kx,kx->k", gap, gap) < _CROSSED**2
    return np.asarray(np.where(crossed[:, None], centers[1] - centers[0], gap))


def _support(mesh: LinkMesh, placed: tuple[Array, Array], rows: Indices, u: Array) -> Array:
    """Corners (K, 3) in the world of a link's hull that lie farthest along u (K, 3)."""
    rotations, translations = placed[0][rows], placed[1][rows]
    local = np.einsum("kx,kxy->ky", u, rotations)
    farthest = mesh.hull[(local @ mesh.hull.T).argmax(axis=1)]
    return np.asarray(np.einsum("kxy,ky->kx", rotations, farthest) + translations)


# How far a link can move as seen from another while the joints between them turn a little.
#
# Seen from link A, a joint between A and B turns all that lies beyond it about its axis. Let the
# joints change one after the other, the one nearest to B first: a point x of B at distance ρ from
# the axis then moves by at most |Δq| (ρ + what x has moved before). Summed over the joints
# between them this bounds the motion of x seen from A, whatever the joints do within |Δq|, and
# the distance of A and B changes by no more. ρ is convex in x, so the corners of a box around B
# bound it. Seen from B, A moves by another bound; the smaller of both holds.


class RelativeReach:
    """Bounds on the relative motion of links from bounds on the changes of the joints."""

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        self._robot, first = robot, robot.first_joint
        self._columns = [max(j - first, -1) for j in range(model.njoints)]
        self._supports = [list(model.supports[j])[1:] for j in range(model.njoints)]
        self.axes = np.zeros((model.njoints, 3))
        for joint in range(1, model.njoints):
            if self._columns[joint] >= 0:
                twist = np.array(model.joints[joint].createData().S, dtype=float).reshape(6)
                self.axes[joint] = twist[3:]
        self._paths: dict[tuple[int, int], list[int]] = {}

    def between(self, poses: Poses, first: LinkMesh, second: LinkMesh, change: Array) -> Array:
        """Bound (K,) [m] on the change of the distance of two links.

        `poses` are those of the K middles, `change` (K, n) how far each joint may be from there.
        """
        return self.at(poses, change).between(first, second)

    def at(self, poses: Poses, change: Array) -> "ReachAt":
        """The same for many pairs of links at K middles."""
        return ReachAt(self, poses, np.abs(self._robot.all_rates(change)))

    def path(self, first: int, second: int) -> list[int]:
        """Moved joints between two joints, in order from the first to the second."""
        if (first, second) not in self._paths:
            up, down = self._supports[first], self._supports[second]
            shared = set(up) & set(down)
            joints = [j for j in up[::-1] if j not in shared] + [j for j in down if j not in shared]
            self._paths[first, second] = [j for j in joints if self._columns[j] >= 0]
        return self._paths[first, second]

    def turn(self, joint: int, change: Array) -> Array:
        """The change (K,) of a joint of the model out of those of all that move (K, m)."""
        return change[:, self._columns[joint]]


class ReachAt:
    """Bounds at K middles. What one link moves up to a joint serves all links beyond that joint."""

    def __init__(self, reach: RelativeReach, poses: Poses, change: Array) -> None:
        self._reach, self._poses, self._change = reach, poses, change
        self._corners: dict[str, Array] = {}
        self._moved: dict[tuple[str, int], Array] = {}

    def between(self, first: LinkMesh, second: LinkMesh) -> Array:
        """Bound (K,) [m] on the change of the distance of two links."""
        path = self._reach.path(first.joint, second.joint)
        return np.minimum(self._seen(second, path[::-1]), self._seen(first, path))

    def _seen(self, link: LinkMesh, path: list[int]) -> Array:
        """Bound (K,) on the motion of a link; `path` from its own side to the other."""
        moved = np.zeros(len(self._poses))
        for joint in path:  # in a tree, only one way leads from a link to a joint
            if (link.link, joint) not in self._moved:
                self._moved[link.link, joint] = self._beyond(link, joint, moved)
            moved = self._moved[link.link, joint]
        return moved

    def _beyond(self, link: LinkMesh, joint: int, moved: Array) -> Array:
        """Bound (K,) with one more joint, on top of what nearer ones have moved."""
        axis, turn = self._reach.axes[joint], self._reach.turn(joint, self._change)
        if not axis.any():  # it slides
            return moved + turn
        if link.link not in self._corners:
            self._corners[link.link] = self._poses.points(link.joint, link.box)
        axis = self._poses.rotations[:, joint] @ axis
        arm = self._corners[link.link] - self._poses.translations[:, joint][:, None]
        along = np.einsum("kcx,kx->kc", arm, axis)
        square = np.einsum("kcx,kcx->kc", arm, arm) - along**2
        return np.asarray(moved + turn * (np.sqrt(np.maximum(square, 0.0).max(axis=1)) + moved))
