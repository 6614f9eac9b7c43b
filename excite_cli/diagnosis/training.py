"""The training data of a diagnosis: motion, inertial columns and torque of every part."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.evidence import Evidence, Grams, JointGram
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.identification.covariance import RunRows
from excite_cli.identification.prepare import PreparedRun
from excite_cli.out_of_core import Spool, forget
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# Blocks of a run whose samples are fitted and judged in turn; short runs have four at least.
_BLOCK = 1.0  # s
_FEWEST_BLOCKS = 4


@dataclass(frozen=True)
class PartColumns:
    """Columns (M, rows, width) per part on the rows of some joints, whoever made them."""

    rows: tuple[int, ...]
    columns: tuple[Array, ...]

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.columns[0].shape[2])


Columns = Candidate | PartColumns  # what may be added to the model


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
    def sides(self) -> "BlocksOfTime":
        """Two sides of every fold, blocks of a second in turn: 2f and 2f + 1 of fold f."""
        sides = (_sides(run.averaged(run.t)) for run in self.runs)
        owners = tuple(2 * fold + own for fold, own in zip(self.folds, sides, strict=True))
        return BlocksOfTime(2 * (max(self.folds) + 1), owners)

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
        blocks: "BlocksOfTime | None" = None,
    ) -> Evidence:
        """Gram matrices of all columns, whitened by `noise`; linear in the number of samples.

        In the `blocks` of time, or the `sides` if none are given.
        """
        starts = self._starts(candidates)
        nothing = np.zeros((starts[0] + 1, starts[0] + 1))
        return Evidence(
            Grams(self._grams(candidates, noise, blocks or self.sides), int(starts[-1]) + 1),
            int(starts[0]),
            [np.arange(*ends) for ends in pairwise(starts)],
            [c.rows for c in candidates],
            nothing if self.prior is None else self.prior,
            nothing if self.weighed is None else self.weighed,
        )

    def _grams(
        self, candidates: Sequence[Columns], noise: NoiseModel, blocks: "BlocksOfTime"
    ) -> list[JointGram]:
        """Gram matrices of the whitened rows of every joint."""
        # Two tasks a joint: an odd number of joints would leave the last of two workers alone.
        parts = [half for half in np.array_split(np.arange(len(self.runs)), 2) if len(half)]
        tasks = (
            (joint, [(*self._rows_of(candidates, joint, k), blocks.owners[k]) for k in half])
            for joint in range(self.n)
            for half in parts
        )
        made = each(_blocks_of, (blocks.count, noise), tasks)
        return [
            JointGram(self._active(candidates, joint), np.asarray(sum(next(made) for _ in parts)))
            for joint in range(self.n)
        ]

    def _starts(self, candidates: Sequence[Columns]) -> Indices:
        """Where the columns of every candidate begin among all, and where the last ones end."""
        return self.declared[0].shape[2] + np.cumsum([0, *(c.width for c in candidates)])

    def _active(self, candidates: Sequence[Columns], joint: int) -> Indices:
        """Columns (A,) of the declared model and of the candidates in the rows of a joint."""
        starts = self._starts(candidates)
        there = [i for i, c in enumerate(candidates) if joint in c.rows]
        return np.concatenate(
            [np.arange(starts[0]), *(np.arange(*starts[i : i + 2]) for i in there)]
        ).astype(np.intp)

    def _rows_of(
        self, candidates: Sequence[Columns], joint: int, part: int
    ) -> tuple[list[Array], Mask]:
        """Columns (M, …) of one joint's rows in a part, torque last; which rows are usable (M,)."""
        touching = [c for c in candidates if joint in c.rows]
        columns = [
            self.declared[part][:, joint],
            *(c.columns[part][:, c.rows.index(joint)] for c in touching),
            self.tau[part][:, joint, None],
        ]
        return columns, self.runs[part].usable[:, joint]

    def rows(self, candidates: Sequence[Columns], chosen: Sequence[int]) -> list[RunRows]:
        """Rows of every run for the regression of `identify`."""
        spool, found = Spool(), []
        for part, run in enumerate(self.runs):
            joints = [self.columns(candidates, chosen, part, joint) for joint in range(self.n)]
            columns = spool.keep(np.stack(joints, axis=1))
            own = RunRows(columns, self.tau[part], run.usable)
            found.append(replace(own, rounding=run.rounding, unsure=run.unsure))
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
class BlocksOfTime:
    """Which of `count` blocks every sample (M,) of every part is in."""

    count: int
    owners: tuple[Indices, ...]


def _blocks_of(
    shared: tuple[int, NoiseModel],
    task: tuple[int, Sequence[tuple[list[Array], Mask, Indices]]],
    tell: Tell,
) -> Array:
    """Gram matrices (B, A + 1, A + 1) of the whitened rows of one joint in some parts."""
    count, noise = shared
    joint, parts = task
    size = sum(own.shape[1] for own in parts[0][0])
    found = np.zeros((count, size, size))
    for columns, usable, owner in parts:
        white = noise.whitened(np.concatenate(columns, axis=1), joint, usable)
        for block in np.unique(owner[usable]):
            own = white[owner[usable] == block]
            found[block] += own.T @ own
        forget()
    return found


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


def _sides(t: Array) -> Indices:
    """Side 0 or 1 (M,) of every sample."""
    span = float(t[-1] - t[0])
    block = max(min(_BLOCK, span / _FEWEST_BLOCKS), 1e-12)
    return np.asarray(np.floor((t - t[0]) / block) % 2).astype(np.intp)
