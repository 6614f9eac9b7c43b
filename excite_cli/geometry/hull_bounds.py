"""Lower bounds of the distance of two convex hulls at many instants at once.

For any unit vector u, all of B lies at least  min_B u·x − max_A u·x  beyond A: a proof whatever u
is, and only its sharpness depends on u. Gilbert's iteration finds a good one: v is a point of
B − A, w the corner of B − A that is lowest along u = v/|v| (so u·w is the bound), and the next v
is the point of the segment from v to w that is nearest to the origin.
"""

import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.link_meshes import LinkMesh, Poses
from excite_cli.geometry.world_segments import nearest_points
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

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
