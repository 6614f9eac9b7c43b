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

from excite_cli.robot.link_meshes import LinkMesh, Poses
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]


class RelativeReach:
    """Bounds on the relative motion of links from bounds on the changes of the joints."""

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        first = int(robot.moved[0])
        self._columns = [model.joints[j].idx_v - first if j else -1 for j in range(model.njoints)]
        self._supports = [list(model.supports[j])[1:] for j in range(model.njoints)]
        self._axes = np.zeros((model.njoints, 3))
        for joint in range(1, model.njoints):
            if self._columns[joint] >= 0:
                twist = np.array(model.joints[joint].createData().S, dtype=float).reshape(6)
                self._axes[joint] = twist[3:]

    def between(self, poses: Poses, first: LinkMesh, second: LinkMesh, change: Array) -> Array:
        """Bound (K,) [m] on the change of the distance of two links.

        `poses` are those of the K middles, `change` (K, n) how far each joint may be from there.
        """
        path = self._path(first.joint, second.joint)
        return np.minimum(
            self._seen(poses, second, path[::-1], change), self._seen(poses, first, path, change)
        )

    def _path(self, first: int, second: int) -> list[int]:
        """Moved joints between two joints, in order from the first to the second."""
        up, down = self._supports[first], self._supports[second]
        shared = set(up) & set(down)
        joints = [j for j in up[::-1] if j not in shared] + [j for j in down if j not in shared]
        return [j for j in joints if self._columns[j] >= 0]

    def _seen(self, poses: Poses, link: LinkMesh, path: list[int], change: Array) -> Array:
        """Bound (K,) on the motion of a link; `path` from its own side to the other."""
        corners = poses.points(link.joint, link.box)
        moved = np.zeros(len(poses))
        for joint in path:
            turn = change[:, self._columns[joint]]
            if not self._axes[joint].any():  # it slides
                moved = moved + turn
                continue
            axis = poses.rotations[:, joint] @ self._axes[joint]
            arm = corners - poses.translations[:, joint][:, None]
            along = np.einsum("kcx,kx->kc", arm, axis)
            square = np.einsum("kcx,kcx->kc", arm, arm) - along**2
            moved = moved + turn * (np.sqrt(np.maximum(square, 0.0)).max(axis=1) + moved)
        return moved
