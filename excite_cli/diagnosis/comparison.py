"""The one comparison: would a model predict a new recording better than another?

The training data are cut into blocks b of a second, and each is predicted by models fitted without
it: to the other runs alone, if there are three or more, and else to the blocks in which the joint
is elsewhere, without one quarter of its travel each. With E_jb the energy that is left on joint j,

    d_b = Σ_j log((E_jb(S) + ε_j) / (E_jb(S') + ε_j)),    D = Σ_b d_b,    s² = B · var(d_b):

the log-likelihood that is gained where the noise of a block is what is left of it, and its standard
error. The same blocks are in both, so that what no model explains does not count, and the logarithm
makes blocks alike in which there is more or less of the same. Next to nothing is left of a block in
which a joint hardly moves, and that says nothing: ε_j is a twentieth of what both leave of an
average block. S' is better where D > t s, t of Student's distribution with B − 1 degrees of freedom
at the one confidence, which is higher for one recording alone.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.blocks import Blocks
from excite_cli.diagnosis.training import Columns, TrainingData
from excite_cli.robot.model import Array

_LEAST = 0.05  # of what is left of an average block
# Fitted to one run alone the other is hardly predicted, the more so by a larger model: the KR300's
# split A was given the textbook, 6.2 %, for 5.4 %.
_FEWEST_RUNS = 3
SECONDS = 1.0  # of a block: beyond the memory of what is left, of real arms 0.1 to 0.5 s
_MOST = 96  # blocks: of an hour-long log they are longer
_PARTS = 4  # of a joint's travel
_GROUPS = 8  # of blocks that are left out together


@dataclass(frozen=True)
class Difference:
    """By how much the second model predicts better, D, its standard error s, B, and the joints."""

    size: float
    error: float
    blocks: int
    joints: int
    confidence: float = 0.5

    @property
    def better(self) -> bool:
        """Whether the second is better with the one confidence that is asked for."""
        return self.size > float(student.ppf(self.confidence, self.blocks - 1)) * self.error

    @property
    def of_error(self) -> float:
        """Logarithm of the ratio of RMS errors, mean over joints and blocks."""
        return self.size / (2 * self.blocks * self.joints)


class Comparison:
    """Compares models of some candidates on the filtered torque."""

    def __init__(
        self,
        data: TrainingData,
        candidates: Sequence[Columns],
        members: Collection[int],
        levels: Array,
    ) -> None:
        """Of models of the `members` of the candidates; `levels` (n,) [N·m] weigh the joints."""
        seconds = _seconds(data, candidates, members, levels)
        self._new, self._same = seconds.left_out(), seconds.in_turn()
        self._confidence = rules.OF_ONE_RECORDING if seconds.recordings < 2 else rules.CONFIDENCE

    def difference(self, one: Sequence[int], other: Sequence[int]) -> Difference:
        """How much better `other` predicts new recordings than `one`."""
        before, after = (
            np.concatenate([blocks.energies(some, joints) for joints, blocks in self._new])
            for some in (one, other)
        )
        return replace(_difference(before, after), confidence=self._confidence)

    def missed(self, chosen: Sequence[int], rest: Sequence[int], rows: Sequence[int]) -> bool:
        """Whether seconds left out of the same recordings surely miss what `rest` lacks.

        Of what acts on several joints (`rows`), on those but the one that gains most: an effect of
        one joint that has no name yet passes for a tilt of the base, or for friction of two joints.
        """
        before, after = map(self._same.energies, (rest, chosen))
        if len(rows) > 1:
            gains = [_difference(before[[j]], after[[j]]).size for j in rows]
            others = [j for j in rows if j != rows[int(np.argmax(gains))]]
            before, after = before[others], after[others]
        return replace(_difference(before, after), confidence=rules.OF_A_NAME).better


def _difference(before: Array, after: Array) -> Difference:
    joints, blocks = before.shape
    least = _LEAST * ((before + after) / 2.0).mean(axis=1, keepdims=True) + 1e-300
    gained: Array = np.log((before + least) / (after + least)).sum(axis=0)
    error = float(np.sqrt(blocks) * gained.std(ddof=1)) if blocks > 1 else np.inf
    return Difference(float(gained.sum()), error, blocks, joints)


_Columns = Callable[[Sequence[int]], NDArray[np.intp]]
_Given = tuple[
    list[NDArray[np.intp]], list[Array], Array, _Columns, Callable[[int], NDArray[np.intp]]
]


@dataclass(frozen=True)
class _Seconds:
    """Gram matrices of every joint in blocks of a second, rows weighted, columns normalised.

    `given`: columns of the joints, these matrices, their sum with what is known without the data,
    the columns of models and of members (`Blocks`). `folds` (B,): runs, or groups of parts of one.
    `places` (B, n): where the joints are.
    """

    given: _Given
    folds: NDArray[np.intp]
    places: Array
    recordings: int

    def in_turn(self) -> Blocks:
        """Fitted to the other blocks of all runs: what one run carries is known from these."""
        count = len(self.folds)
        return Blocks(*self.given, np.arange(count) % min(_GROUPS, max(count // 2, 2)))

    def left_out(self) -> list[tuple[list[int], Blocks]]:
        """As a new recording would be predicted: some joints, and blocks to be left out of theirs.

        Whole runs if there are enough, else those in which a joint is in one part of its travel.
        """
        joints = list(range(self.places.shape[1]))
        if self.recordings >= _FEWEST_RUNS:
            return [(joints, Blocks(*self.given, self.folds))]
        parts = min(_PARTS, len(self.folds))
        ranks = self.places.argsort(axis=0).argsort(axis=0)
        groups = ranks * parts // len(self.folds)
        return [([j], Blocks(*self.given, groups[:, j])) for j in joints]


def _seconds(
    data: TrainingData, candidates: Sequence[Columns], members: Collection[int], levels: Array
) -> _Seconds:
    """Of models of the `members` of the candidates, rows of a joint over its level."""
    order = sorted(members)
    chosen = [candidates[i] for i in order]
    fixed = data.declared[0].shape[2]
    ends = fixed + np.cumsum([0, *(c.width for c in chosen)])
    own = {i: np.arange(*pair) for i, pair in zip(order, pairwise(ends), strict=True)}
    owner, folds = _cut(data)
    active, grams = [], []
    for joint in range(data.n):
        rows = data.rows_of(chosen, joint)
        of_joint = np.zeros((len(folds), len(rows.active) + 1, len(rows.active) + 1))
        for blocks, usable, block in zip(rows.blocks, rows.usable, owner, strict=True):
            weighted = np.concatenate(blocks, axis=1)[usable] / levels[joint]
            for b in np.unique(block[usable]):
                part = weighted[block[usable] == b]
                of_joint[b] += part.T @ part
        active.append(np.append(rows.active, int(ends[-1])))
        grams.append(of_joint)
    total = np.zeros((ends[-1] + 1, ends[-1] + 1))
    if data.prior is not None:
        known = np.append(np.arange(fixed), ends[-1])
        total[np.ix_(known, known)] += data.prior
    for at, gram in zip(active, grams, strict=True):
        total[np.ix_(at, at)] += gram.sum(axis=0)
    norms = np.sqrt(np.diag(total))
    norms[norms < 1e-100] = 1.0
    norms[-1] = 1.0
    for at, gram in zip(active, grams, strict=True):
        gram /= np.outer(norms[at], norms[at])
    total /= np.outer(norms, norms)

    def columns(some: Sequence[int]) -> NDArray[np.intp]:
        return np.concatenate([np.arange(fixed), *(own[i] for i in some)]).astype(np.intp)

    given = active, grams, total, columns, own.__getitem__
    recordings = len({part.run.name for part in data.runs})
    return _Seconds(given, folds, _places(data, owner, len(folds)), recordings)


def _cut(data: TrainingData) -> tuple[list[NDArray[np.intp]], NDArray[np.intp]]:
    """Of every part the block (M,) of each sample, and the fold (B,) of each block."""
    times = [run.averaged(run.t) for run in data.runs]
    whole = sum(float(t[-1] - t[0]) for t in times)
    length = max(SECONDS, whole / _MOST)
    owner: list[NDArray[np.intp]] = []
    folds: list[int] = []
    for t, fold in zip(times, data.folds, strict=True):
        span = max(float(t[-1] - t[0]), 1e-12)
        count = max(round(span / length), 1)
        own = np.minimum((t - t[0]) / span * count, count - 1)
        owner.append(len(folds) + own.astype(np.intp))
        folds += [fold] * count
    return owner, np.array(folds)


def _places(data: TrainingData, owner: Sequence[NDArray[np.intp]], blocks: int) -> Array:
    """Mean position (B, n) of every joint in every block."""
    sums, counts = np.zeros((blocks, data.n)), np.zeros(blocks)
    for run, block in zip(data.runs, owner, strict=True):
        np.add.at(sums, block, run.averaged(run.q))
        np.add.at(counts, block, 1.0)
    return sums / np.maximum(counts, 1.0)[:, None]
