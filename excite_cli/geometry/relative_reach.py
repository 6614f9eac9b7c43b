"""How far a link can move as seen from another while the joints between them turn a little.

Seen from link A, a joint between A and B turns all that lies beyond it about its axis. Let the
joints change one after the other, the one nearest to B first: a point x of B at distance ρ from
the axis then moves by at most |Δq| (ρ + what x has moved before). Summed over the joints between
them this bounds the motion of x seen from A, whatever the joints do within |Δq|, and the distance
of A and B changes by no more. ρ is convex in x, so the corners of a box around B bound it.
Seen from B, A moves by another bound; the smaller of both holds.
"""

import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.link_meshes import LinkMesh, Poses
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]


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
