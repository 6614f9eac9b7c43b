"""Gram matrices per joint and fold, of those columns only that show in the joint's rows.

Most candidates act on one joint: of all columns, a joint's rows hold a third or less, and what is
zero is neither stored nor added. Every fold has two sides, blocks of time in turn: what belongs to
a run alone is fitted on one side of it and judged on the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.model import Array


@dataclass(frozen=True)
class JointGram:
    """Of the rows of one joint: `active` (A,) its columns in all, `own` (F, 2, A + 1, A + 1).

    The torque is the last column of `own`, and not among the `active`.
    """

    active: NDArray[np.intp]
    own: Array


class Grams:
    """Gram matrices (F, K, K) of all columns, of any joints' rows; torque is the last column."""

    def __init__(self, joints: Sequence[JointGram], size: int) -> None:
        self.joints, self.size = tuple(joints), size
        self._active = [np.append(joint.active, size - 1) for joint in self.joints]
        self._position = np.full((len(self.joints), size), -1)
        for position, active in zip(self._position, self._active, strict=True):
            position[active] = np.arange(len(active))

    @property
    def folds(self) -> int:
        """F."""
        return len(self.joints[0].own)

    def total(self) -> Array:
        """Sum (K, K) over folds and joints."""
        found = np.zeros((self.size, self.size))
        for fold in range(self.folds):
            self._add(found, fold)
        return found

    def by_fold(self) -> Array:
        """Sums (F, K, K) over joints."""
        found = np.zeros((self.folds, self.size, self.size))
        for fold in range(self.folds):
            self._add(found[fold], fold)
        return found

    def _add(self, to: Array, fold: int) -> None:
        for joint, active in zip(self.joints, self._active, strict=True):
            to[np.ix_(active, active)] += joint.own[fold].sum(axis=0)

    def seen(self) -> Array:
        """Energy (F, K) of every column in every fold."""
        found = np.zeros((self.folds, self.size))
        for joint, active in zip(self.joints, self._active, strict=True):
            found[:, active] += np.einsum("fskk->fk", joint.own)
        return found

    def on(
        self,
        folds: Sequence[int],
        joints: Sequence[int],
        at: NDArray[np.intp],
        sides: slice = slice(None),
    ) -> Array:
        """Sum (k, k) over some folds' `sides` and rows of `joints`, of the columns `at` (k,)."""
        places = []
        for j in joints:
            position = self._position[j, at]
            there = np.flatnonzero(position >= 0)
            position = position[there]
            places.append((j, (position[:, None], position), (there[:, None], there)))
        found = np.zeros((len(at), len(at)))
        for j, own, to in places:
            for grams in self._summed(j, folds, sides):
                part = grams[own]
                if len(part) == len(at):
                    found += part
                else:
                    found[to] += part
        return found

    def _summed(self, joint: int, folds: Sequence[int], sides: slice) -> list[Array]:
        """Gram matrices (k, k) of a joint, to be summed; sums that are asked for often are kept."""
        if sides != slice(None):
            return [side for fold in folds for side in self.joints[joint].own[fold, sides]]
        if len(folds) == self.folds:
            return [self._whole[joint]]
        return [self._by_fold[joint][fold] for fold in folds]

    @cached_property
    def _by_fold(self) -> list[Array]:
        return [joint.own.sum(axis=1) for joint in self.joints]

    @cached_property
    def _whole(self) -> list[Array]:
        return [joint.own.sum(axis=(0, 1)) for joint in self.joints]

    def first_sides(self) -> Array:
        """Sums (F, K, K) over joints of the first side of every fold."""
        found = np.zeros((self.folds, self.size, self.size))
        for joint, active in zip(self.joints, self._active, strict=True):
            found[:, active[:, None], active] += joint.own[:, 0]
        return found

    def torque_energy(self, joint: int) -> float:
        """Energy of the torque itself on a joint's rows."""
        return float(self.joints[joint].own[:, :, -1, -1].sum())
