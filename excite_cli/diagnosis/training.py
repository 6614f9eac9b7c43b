"""The training data of a diagnosis: motion, inertial columns and torque of every part."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.grams import Grams, JointGram, joined
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.identification.covariance import Rows
from excite_cli.identification.prepare import PreparedRun
from excite_cli.out_of_core import Spool, forget
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

# Blocks of a run whose samples are fitted and judged in turn; short runs have four at least.
_BLOCK = 1.0  # s
_FEWEST_BLOCKS = 4


class Columns(Protocol):
    """What may be added to the model: the joints it acts on, columns (M, rows, width) per part."""

    @property
    def rows(self) -> tuple[int, ...]:
        """Joints."""

    @property
    def columns(self) -> tuple[Array, ...]:
        """Per part, filtered and decimated."""

    @property
    def width(self) -> int:
        """Number of columns."""


@dataclass(frozen=True)
class TrainingData:
    """Parts of runs with the columns of the declared model.

    `declared[i]` (M_i, n, k): inertial columns, then those of the declared effects. `folds` says
    which parts are left out together.

    `prior` (k + 1, k + 1): Gram matrix of rows [W target] of unit variance, what is known of the
    parameters without these data; `weighed`: the part of it that scales say. None: nothing.
    """

    runs: tuple[PreparedRun, ...]
    folds: tuple[int, ...]
    declared: tuple[Array, ...]
    tau: tuple[Array, ...]
    prior: Array | None = None
    weighed: Array | None = None

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.tau[0].shape[1])

    @cached_property
    def sides(self) -> tuple[NDArray[np.bool_], ...]:
        """Which side (M,) of its fold every sample is on: blocks of time in turn."""
        return tuple(_sides(run.averaged(run.t)) for run in self.runs)

    def columns(
        self, candidates: Sequence[Columns], chosen: Sequence[int], part: int, joint: int
    ) -> Array:
        """Columns (M, k) of the declared model and the chosen candidates in one joint's rows."""
        declared = self.declared[part][:, joint]
        blocks = [declared]
        for i in chosen:
            c = candidates[i]
            if joint in c.rows:
                blocks.append(c.columns[part][:, c.rows.index(joint)])
            else:
                blocks.append(np.zeros((len(declared), c.width)))
        return np.concatenate(blocks, axis=1)

    def evidence(
        self,
        candidates: Sequence[Columns],
        noise: NoiseModel,
        known: Mapping[int, JointGram] | None = None,
    ) -> Evidence:
        """Gram matrices of all columns, whitened by `noise`; linear in the number of samples.

        `known`: Gram matrices, with this noise, of joints whose rows hold no candidate but those
        they were made with, which come first here too.
        """
        known = known or {}
        starts = self._starts(candidates)
        made = self.grams(candidates, noise, [j for j in range(self.n) if j not in known])
        grams = [known[joint] if joint in known else made[joint] for joint in range(self.n)]
        return Evidence(
            Grams(grams, int(starts[-1]) + 1),
            int(starts[0]),
            [np.arange(*ends) for ends in pairwise(starts)],
            [c.rows for c in candidates],
            self.prior,
            self.weighed,
        )

    def grams(
        self, candidates: Sequence[Columns], noise: NoiseModel, joints: Sequence[int]
    ) -> dict[int, JointGram]:
        """Gram matrices of the whitened rows of some joints."""
        # Two tasks a joint: an odd number of joints would leave the last of two workers alone.
        halves = _halves(self.folds)
        tasks = (
            (self.rows_of(candidates, joint, parts), [self.folds[part] for part in parts])
            for joint in joints
            for parts in halves
        )
        found = each(_gram, (max(self.folds) + 1, noise), tasks)
        return {joint: joined([next(found) for _ in halves]) for joint in joints}

    def _starts(self, candidates: Sequence[Columns]) -> NDArray[np.intp]:
        """Where the columns of every candidate begin among all, and where the last ones end."""
        return self.declared[0].shape[2] + np.cumsum([0, *(c.width for c in candidates)])

    def rows_of(
        self, candidates: Sequence[Columns], joint: int, parts: Sequence[int] | None = None
    ) -> "JointRows":
        """What shows in the rows of one joint of the declared model and the candidates.

        Of all parts, or those given.
        """
        parts = range(len(self.runs)) if parts is None else parts
        starts = self._starts(candidates)
        there = [i for i, c in enumerate(candidates) if joint in c.rows]
        touching = [candidates[i] for i in there]
        active = [np.arange(starts[0]), *(np.arange(*starts[i : i + 2]) for i in there)]
        return JointRows(
            joint,
            np.concatenate(active).astype(np.intp),
            [
                [
                    self.declared[part][:, joint],
                    *(c.columns[part][:, c.rows.index(joint)] for c in touching),
                    self.tau[part][:, joint, None],
                ]
                for part in parts
            ],
            [self.runs[part].usable[:, joint] for part in parts],
            [self.sides[part] for part in parts],
        )

    def rows(self, candidates: Sequence[Columns], chosen: Sequence[int]) -> list[Rows]:
        """Rows of every run for the regression of `identify`."""
        spool, found = Spool(), []
        for part, run in enumerate(self.runs):
            joints = [self.columns(candidates, chosen, part, joint) for joint in range(self.n)]
            columns = spool.keep(np.stack(joints, axis=1))
            found.append(Rows(columns, self.tau[part], run.usable, rounding=run.rounding))
            forget()
        return found

    def residuals(
        self, candidates: Sequence[Columns], chosen: Sequence[int], parameters: Array
    ) -> list[Array]:
        """τ − model (M, n) of every part."""
        taken = [candidates[i] for i in chosen]
        ends = np.cumsum([0, self.declared[0].shape[2], *(c.width for c in taken)])
        shared = [c.rows for c in taken], [parameters[a:b] for a, b in pairwise(ends)]
        tasks = (
            (tau, self.declared[part], [c.columns[part] for c in taken])
            for part, tau in enumerate(self.tau)
        )
        return list(each(_residual, shared, tasks))


@dataclass(frozen=True)
class JointRows:
    """Rows of one joint: `active` (A,) says which columns, and of every part there are blocks of
    them (M, k), the torque last; which samples are usable, and on which side of their fold."""

    joint: int
    active: NDArray[np.intp]
    blocks: Sequence[Sequence[Array]]
    usable: Sequence[NDArray[np.bool_]]
    sides: Sequence[NDArray[np.bool_]]


def _gram(
    shared: tuple[int, NoiseModel], task: tuple[JointRows, Sequence[int]], tell: Tell
) -> JointGram:
    """Gram matrices of the whitened rows of one joint, of parts of the folds that are told."""
    folds, noise = shared
    rows, of_parts = task
    size = len(rows.active) + 1
    whole = np.zeros((folds, size, size))
    first = np.zeros_like(whole)
    for fold, blocks, usable, side in zip(
        of_parts, rows.blocks, rows.usable, rows.sides, strict=True
    ):
        white = noise.whitened(np.concatenate(blocks, axis=1), rows.joint, usable)
        whole[fold] += white.T @ white
        own = white[~side[usable]]
        first[fold] += own.T @ own
        forget()
    return JointGram(rows.active, whole, first)


def _halves(folds: Sequence[int]) -> list[list[int]]:
    """Parts of the lower and of the upper half of the folds; one list where there is one fold."""
    half = (max(folds) + 1) // 2
    sides = [[part for part, fold in enumerate(folds) if (fold < half) == low] for low in (1, 0)]
    return [side for side in sides if side]


def _residual(
    shared: tuple[Sequence[tuple[int, ...]], Sequence[Array]],
    task: tuple[Array, Array, Sequence[Array]],
    tell: Tell,
) -> Array:
    """τ − model (M, n) of one part; the first of the parameters are of the declared columns."""
    rows_of, (own, *others) = shared
    tau, declared, blocks = task
    residual = tau - declared @ own
    for rows, columns, values in zip(rows_of, blocks, others, strict=True):
        residual[:, list(rows)] -= columns @ values
    return np.asarray(residual)


@dataclass(frozen=True)
class Shown:
    """Columns as they are, whoever made them."""

    rows: tuple[int, ...]
    columns: tuple[Array, ...]
    width: int


def _sides(t: Array) -> NDArray[np.bool_]:
    span = float(t[-1] - t[0])
    block = max(min(_BLOCK, span / _FEWEST_BLOCKS), 1e-12)
    return np.asarray(np.floor((t - t[0]) / block) % 2 > 0.5)
