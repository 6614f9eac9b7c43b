"""Gram matrices per joint and fold, of those columns only that show in the joint's rows.

Most candidates act on one joint: of all columns, a joint's rows hold a third or less, and what is
zero is neither stored nor added. Every fold has two sides, blocks of time in turn: what is fitted
on one side is judged on the other. The second is what the whole has more than the first.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.model import Array


@dataclass(frozen=True)
class JointGram:
    """Of the rows of one joint: `active` (A,) its columns in all.

    `whole` and `first` (F, A + 1, A + 1) are of folds and of their first sides. The torque is their
    last column, and not among the `active`.
    """

    active: NDArray[np.intp]
    whole: Array
    first: Array


def joined(pieces: Sequence[JointGram]) -> JointGram:
    """One of several, each of some of the folds: the others are zero in it."""
    whole, first = (sum(getattr(piece, name) for piece in pieces) for name in ("whole", "first"))
    return JointGram(pieces[0].active, np.asarray(whole), np.asarray(first))


class Grams:
    """Gram matrices (F, K, K) of all columns, of any joints' rows; torque is the last column."""

    def __init__(self, joints: Sequence[JointGram], size: int) -> None:
        self.joints, self.size = tuple(joints), size
        self._active = [np.append(joint.active, size - 1) for joint in self.joints]

    @property
    def folds(self) -> int:
        """F."""
        return len(self.joints[0].whole)

    def total(self) -> Array:
        """Sum (K, K) over folds and joints."""
        found = np.zeros((self.size, self.size))
        for fold in range(self.folds):
            self._add(found, fold)
        return found

    def _add(self, to: Array, fold: int) -> None:
        for joint, active in zip(self.joints, self._active, strict=True):
            to[np.ix_(active, active)] += joint.whole[fold]

    def seen(self) -> Array:
        """Energy (F, K) of every column in every fold."""
        found = np.zeros((self.folds, self.size))
        for joint, active in zip(self.joints, self._active, strict=True):
            found[:, active] += np.einsum("fkk->fk", joint.whole)
        return found

    def torque_energy(self, joint: int) -> float:
        """Energy of the torque itself on a joint's rows."""
        return float(self.joints[joint].whole[:, -1, -1].sum())
