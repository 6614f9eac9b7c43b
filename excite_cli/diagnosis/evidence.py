"""All that the search needs, as Gram matrices: any model is judged without touching samples again.

Columns are [inertial | declared effects | candidates | torque], rows whitened. A Gram matrix is
kept per fold, side (blocks of time in turn) and joint; their sums give the residual energy, the
gain of any candidate, and the error on sides left out, each by solves of the size of the model.
What one run carries no other run knows: so one side of all runs is fitted to predict the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.diagnosis import rules
from excite_cli.diagnosis.blocks import Blocks, keep
from excite_cli.diagnosis.schur import (
    ABSORBED,
    RIDGE,
    SHARED,
    CandidateBases,
    Cholesky,
    Gain,
    Schur,
    gain_of_columns,
)

# Gram matrices per joint and block of time, of those columns only that show in the joint's rows.
#
# Most candidates act on one joint: of all columns, a joint's rows hold a third or less, and what is
# zero is neither stored nor added.


@dataclass(frozen=True)
class JointGram:
    """Of the rows of one joint: `active` (A,) its columns in all, `blocks` (B, A + 1, A + 1).

    The torque is the last column of the blocks, and not among the `active`.
    """

    active: Indices
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


_THERE = 1e-5  # of a column's energy: of less in a fold, it is not there
_BY_WEIGHT = 4.0  # times what the data leave: the deviation is half of theirs, or less
_NEXT_TO_NOTHING = 1e-6  # of a prior's precision
_KEPT = 6  # of each that is kept: a step of a search asks for the same few again


class Evidence:
    """Gram matrices per fold and joint of normalised columns; torque is the last.

    `blocks[i]` are the columns of candidate i; the first `fixed` columns are the declared model.
    `prior` and, as a part of it, `weighed` (fixed + 1, fixed + 1) as in `TrainingData`.
    """

    def __init__(
        self,
        grams: Grams,
        fixed: int,
        blocks: Sequence[Indices],
        rows_of: Sequence[tuple[int, ...]],
        prior: Array,
        weighed: Array,
    ) -> None:
        self.grams, self.fixed, self.blocks = grams, fixed, list(blocks)
        self.rows_of = list(rows_of)
        total = grams.total()
        known = np.append(np.arange(fixed), len(total) - 1)
        total[np.ix_(known, known)] += prior
        norms = np.sqrt(np.diag(total))
        norms[norms < 1e-100] = 1.0
        norms[-1] = 1.0
        self.norms = norms
        self.total = total / np.outer(norms, norms)
        # Searches come back to the same models: what was solved once is kept.
        self._solved: dict[tuple[int, ...], Array] = {}
        self._energies: dict[tuple[int, ...], float] = {}
        self._factors: dict[tuple[int, ...], Cholesky] = {}
        self._inverses: dict[tuple[int, ...], Array] = {}  # of the last model
        self._wholes: dict[tuple[int, ...], Schur] = {}
        self._projections: dict[tuple[int, ...], Schur] = {}
        self._candidates = CandidateBases(self.total, fixed, self.blocks)
        self._weighed, self._otherwise_known = weighed, prior - weighed

    @cached_property
    def _unweighed(self) -> "Evidence":
        """The same without what was weighed."""
        return self._with(self._otherwise_known, np.zeros_like(self._weighed))

    @cached_property
    def without_prior(self) -> "Evidence":
        """The same with so wide a prior that data and what was weighed say all; itself if none."""
        if not self._otherwise_known.any():
            return self
        wide = _NEXT_TO_NOTHING * self._otherwise_known
        return self._with(wide + self._weighed, self._weighed)

    def _with(self, prior: Array, weighed: Array) -> "Evidence":
        return Evidence(self.grams, self.fixed, self.blocks, self.rows_of, prior, weighed)

    @property
    def torque(self) -> int:
        """Index of the torque's column."""
        return self.total.shape[0] - 1

    def columns(self, chosen: Sequence[int]) -> Indices:
        """Columns of the declared model and the chosen candidates."""
        return np.concatenate([np.arange(self.fixed), *(self.blocks[i] for i in chosen)]).astype(
            np.intp
        )

    def factor(self, chosen: Sequence[int]) -> Cholesky:
        """Cholesky factor of the normal matrix (normalised columns) of a model."""
        key = tuple(chosen)
        if key not in self._factors:
            at = self.columns(key)
            normal = self.total[at[:, None], at]
            normal[np.diag_indices(len(at))] += RIDGE  # for columns that say nothing
            keep(self._factors, key, Cholesky(normal), _KEPT)
        return self._factors[key]

    def solve(self, chosen: Sequence[int]) -> Array:
        """Parameters (raw units) of the model with the chosen candidates."""
        key = tuple(chosen)
        if key not in self._solved:
            at = self.columns(key)
            self._solved[key] = self.factor(key).solve(self.total[at, self.torque]) / self.norms[at]
        return self._solved[key]

    def covariance(self, chosen: Sequence[int], directions: Array | None = None) -> Array:
        """Covariance of `solve`'s parameters for unit noise, or of sums (k, d) of these."""
        norms = self.norms[self.columns(chosen)]
        sums = (np.eye(len(norms)) if directions is None else directions) / norms[:, None]
        return np.asarray(sums.T @ self.factor(chosen).solve(sums))

    def energy(self, chosen: Sequence[int]) -> float:
        """Residual energy (with the prior's, if any) of the model with the chosen candidates."""
        key = tuple(sorted(chosen))
        if key not in self._energies:
            rhs = self.total[self.columns(key), self.torque]
            explained = rhs @ self.factor(key).solve(rhs)
            self._energies[key] = float(self.total[self.torque, self.torque] - explained)
        return self._energies[key]

    def schur(self, chosen: Sequence[int]) -> Schur:
        """What is left of every candidate once the chosen model has taken its part.

        Where that of a model with one member more is known, it is a projection away.
        """
        key = tuple(sorted(chosen))
        if key in self._wholes:
            return self._wholes[key]
        if key not in self._projections:
            more = None if self._weighed.any() else self._with_one_more(key)
            if more is None:
                keep(self._wholes, key, self._schur(key), _KEPT)
                return self._wholes[key]
            keep(self._projections, key, self._projected(key, more), _KEPT)
        return self._projections[key]

    def _with_one_more(self, chosen: tuple[int, ...]) -> tuple[int, ...] | None:
        """A model that was solved and has one member more."""
        one_more = (key for key in self._wholes if len(key) == len(chosen) + 1)
        return next((key for key in one_more if set(chosen) < set(key)), None)

    def _projected(self, rest: tuple[int, ...], key: tuple[int, ...]) -> Schur:
        """That of the model `key` without the one member that is not in `rest`.

        With W = N⁻¹ G_Sc, its rows W_i and the block P_ii of N⁻¹ of the member, what is left of a
        candidate grows by W_iᵀ P_ii⁻¹ W_i, and the residual's energy by θ_iᵀ P_ii⁻¹ θ_i.
        """
        (member,) = set(key) - set(rest)
        own = self._own_columns(member, key)
        inverse = np.asarray(np.linalg.inv(self._inverse(key)[own, own]))
        values = (self.solve(key) * self.norms[self.columns(key)])[own]
        if rest not in self._energies:
            self._energies[rest] = self.energy(key) + float(values @ inverse @ values)
        whole = self._wholes.pop(key)
        self._wholes[key] = whole  # the next to be asked for lacks another member
        return whole.without(own, inverse, values)

    def gain_of(self, member: int, chosen: Sequence[int]) -> Gain:
        """What one of the chosen candidates adds to the others, from the inverse of them all.

        Its block of the inverse is the inverse of what the others leave of it.
        """
        key = tuple(sorted(chosen))
        own = self._own_columns(member, key)
        left = np.asarray(np.linalg.inv(self._inverse(key)[own, own]))
        values = (self.solve(key) * self.norms[self.columns(key)])[own]
        basis = self._candidates.basis((member,))
        return gain_of_columns(left, left @ values, basis, SHARED)

    def _own_columns(self, member: int, chosen: tuple[int, ...]) -> slice:
        """Where a member's parameters are among those of a model."""
        widths = [len(self.blocks[i]) for i in chosen]
        start = self.fixed + sum(widths[: chosen.index(member)])
        return slice(start, start + len(self.blocks[member]))

    def _inverse(self, chosen: tuple[int, ...]) -> Array:
        """Of the normal matrix of a model; that of the last one is kept."""
        if chosen not in self._inverses:
            self._inverses.clear()
            self._inverses[chosen] = self.factor(chosen).solve(np.eye(len(self.columns(chosen))))
        return self._inverses[chosen]

    def _schur(self, chosen: Sequence[int]) -> Schur:
        at = self.columns(chosen)
        shared = self.total[at, self.fixed : self.torque]
        solved = self.factor(chosen).solve(shared)
        cross = self.total[self.fixed : -1, -1] - solved.T @ self.total[at, self.torque]
        own = np.diag(self.total)[self.fixed : -1]
        left = own - np.einsum("kp,kp->p", shared, solved)
        told = self._identified_by_prior_only(chosen, left)
        return Schur(self._candidates, (shared, solved), left, cross, told)

    def _identified_by_prior_only(self, chosen: Sequence[int], left: Array) -> Mask:
        """Columns of candidates of which next to nothing is left without what was weighed.

        `left` is of each with it. Candidates have the same norms without it.
        """
        if not self._weighed.any():
            return np.zeros(len(left), bool)
        by_data = self._unweighed.schur(chosen).diagonal
        own = np.diag(self.total)[self.fixed : self.torque]
        told = (left > SHARED * own) & (left > _BY_WEIGHT * by_data)
        return np.asarray(told & (by_data < ABSORBED * own))

    def folds_of(self, candidates: Sequence[int]) -> Mask:
        """Folds (F,) in which one of some candidates is there."""
        columns = np.concatenate([self.blocks[i] for i in candidates])
        return np.asarray(self._there[:, columns].any(axis=1))

    @cached_property
    def _there(self) -> Mask:
        """Which columns (F, K) are there in which fold."""
        energies = self._on_sides[::2] + self._on_sides[1::2]
        return np.asarray(energies > _THERE * energies.sum(axis=0))

    def is_brief(self, candidates: Sequence[int]) -> bool:
        """Whether one of the two sides, blocks of a second in turn, has nearly all of them."""
        sides = self._on_sides[:, np.concatenate([self.blocks[i] for i in candidates])].sum(axis=1)
        halves = sides[::2].sum(), sides[1::2].sum()
        return bool(min(halves) < rules.LEAST_SIDE * sum(halves))

    @cached_property
    def _on_sides(self) -> Array:
        """Energy (2F, K) of every column on every side."""
        return self.grams.seen()

    @cached_property
    def in_turn(self) -> Blocks:
        """Both sides of each fold (2F), blocks of time in turn, fitted to all other sides."""
        return self.in_groups(np.arange(len(self.grams.joints[0].blocks)) % 2)

    @cached_property
    def by_fold(self) -> Blocks:
        """The same sides, those of a fold fitted to all other folds."""
        return self.in_groups(np.arange(len(self.grams.joints[0].blocks)) // 2)

    @cached_property
    def seen(self) -> Blocks:
        """All rows at once, of the model that is fitted to them."""
        every = [each.sum(axis=0)[None] for each in self._normalised]
        return self._blocks(every, np.zeros(1, dtype=np.intp), seen=True)

    def in_groups(self, groups: Indices) -> Blocks:
        """All blocks, those of one of the `groups` (B,) fitted to the others."""
        return self._blocks(self._normalised, groups)

    def _blocks(self, grams: Sequence[Array], groups: Indices, seen: bool = False) -> Blocks:
        own = self.blocks.__getitem__
        return Blocks(self.grams.active, grams, self.total, self.columns, own, groups, seen)

    @cached_property
    def _normalised(self) -> list[Array]:
        """Gram matrices (B, A + 1, A + 1) of the normalised columns of every joint."""
        return [
            joint.blocks / np.outer(self.norms[at], self.norms[at])
            for joint, at in zip(self.grams.joints, self.grams.active, strict=True)
        ]

    def energy_on(self, chosen: Sequence[int], joints: Sequence[int] | None) -> float:
        """Residual energy on the rows of `joints`, of the model fitted to everything."""
        return float(self.seen.energies(chosen, joints).sum())
