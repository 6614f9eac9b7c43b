"""Gram matrices per joint and block of time, of those columns only that show in the joint's rows.

Most candidates act on one joint: of all columns, a joint's rows hold a third or less, and what is
zero is neither stored nor added.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.model import Array


@dataclass(frozen=True)
class JointGram:
    """Of the rows of one joint: `active` (A,) its columns in all, `blocks` (B, A + 1, A + 1).

    The torque is the last column of the blocks, and not among the `active`.
    """

    active: NDArray[np.intp]
    blocks: Array


class Grams:
    """Gram matrices of all K columns, of any joints' rows; torque is the last column.

    `active[j]` are the columns of joint j, the torque with them.
    """

    def __init__(self, joints: Sequence[JointGram], size: int) -> None:
        self.joints, self.size = tuple(joints), size
        self.active = [np.append(joint.active, size - 1) for joint in self.joints]

    def total(self) -> Array:
        """Sum (K, K) over blocks and joints."""
        found = np.zeros((self.size, self.size))
        for joint, active in zip(self.joints, self.active, strict=True):
            found[np.ix_(active, active)] += joint.blocks.sum(axis=0)
        return found

    def seen(self) -> Array:
        """Energy (B, K) of every column in every block."""
        found = np.zeros((len(self.joints[0].blocks), self.size))
        for joint, active in zip(self.joints, self.active, strict=True):
            found[:, active] += np.einsum("bkk->bk", joint.blocks)
        return found

    def torque_energy(self, joint: int) -> float:
        """Energy of the torque itself on a joint's rows."""
        return float(self.joints[joint].blocks[:, -1, -1].sum())
