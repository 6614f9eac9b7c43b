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
at the one confidence; a name is missed likewise, more surely.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from excite_cli.arrays import Array, Indices
from excite_cli.diagnosis import rules
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import BlocksOfTime, Columns, TrainingData

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

    @property
    def better(self) -> bool:
        """Whether the second is better with the one confidence that is asked for."""
        return self.surely(rules.CONFIDENCE)

    def surely(self, confidence: float) -> bool:
        """Whether the second is better with this confidence, one-sided."""
        return self.size > float(student.ppf(confidence, self.blocks - 1)) * self.error

    @property
    def of_error(self) -> float:
        """Logarithm of the ratio of RMS errors, mean over joints and blocks."""
        return self.size / (2 * self.blocks * self.joints)


class ModelComparison:
    """Compares models of some candidates on the filtered torque."""

    def __init__(
        self,
        data: TrainingData,
        candidates: Sequence[Columns],
        members: Collection[int],
        levels: Array,
    ) -> None:
        """Of models of the `members` of the candidates; `levels` (n,) [N·m] weigh the joints."""
        order = sorted(members)
        self._place = {i: k for k, i in enumerate(order)}
        blocks, folds = _cut(data)
        evidence = data.evidence(
            [candidates[i] for i in order], NoiseModel.white(levels), blocks=blocks
        )
        # Fitted to the other blocks of all runs: what one run carries is known from these.
        turns = min(_GROUPS, max(blocks.count // 2, 2))
        self._same = evidence.in_groups(np.arange(blocks.count) % turns)
        recordings = len({part.run.name for part in data.runs})
        # As a new recording would be predicted: some joints, and the blocks with theirs left out.
        joints = list(range(data.n))
        if recordings >= _FEWEST_RUNS:
            self._new = [(joints, evidence.in_groups(folds))]
        else:
            quarters = _quarters_of_travel(data, blocks)
            self._new = [([j], evidence.in_groups(quarters[:, j])) for j in joints]

    def difference(self, one: Sequence[int], other: Sequence[int]) -> Difference:
        """How much better `other` predicts new recordings than `one`."""
        before, after = (
            np.concatenate(
                [blocks.energies(self._at(some), joints) for joints, blocks in self._new]
            )
            for some in (one, other)
        )
        return _difference(before, after)

    def missed(self, chosen: Sequence[int], rest: Sequence[int], rows: Sequence[int]) -> bool:
        """Whether seconds left out of the same recordings surely miss what `rest` lacks.

        Of what acts on several joints (`rows`), on those but the one that gains most: an effect of
        one joint that has no name yet passes for a tilt of the base, or for friction of two joints.
        """
        before, after = (self._same.energies(self._at(some)) for some in (rest, chosen))
        if len(rows) > 1:
            gains = [_difference(before[[j]], after[[j]]).size for j in rows]
            others = [j for j in rows if j != rows[int(np.argmax(gains))]]
            before, after = before[others], after[others]
        return _difference(before, after).surely(rules.OF_A_NAME)

    def _at(self, some: Sequence[int]) -> list[int]:
        """Where candidates are among the members."""
        return [self._place[i] for i in some]


def _difference(before: Array, after: Array) -> Difference:
    joints, blocks = before.shape
    least = _LEAST * ((before + after) / 2.0).mean(axis=1, keepdims=True) + 1e-300
    gained: Array = np.log((before + least) / (after + least)).sum(axis=0)
    error = float(np.sqrt(blocks) * gained.std(ddof=1)) if blocks > 1 else np.inf
    return Difference(float(gained.sum()), error, blocks, joints)


def _cut(data: TrainingData) -> tuple[BlocksOfTime, Indices]:
    """Blocks of a second, or longer ones of a long log, and the fold (B,) of each."""
    times = [run.averaged(run.t) for run in data.runs]
    whole = sum(float(t[-1] - t[0]) for t in times)
    length = max(SECONDS, whole / _MOST)
    owner: list[Indices] = []
    folds: list[int] = []
    for t, fold in zip(times, data.folds, strict=True):
        span = max(float(t[-1] - t[0]), 1e-12)
        count = max(round(span / length), 1)
        own = np.minimum((t - t[0]) / span * count, count - 1)
        owner.append(len(folds) + own.astype(np.intp))
        folds += [fold] * count
    return BlocksOfTime(len(folds), tuple(owner)), np.array(folds)


def _quarters_of_travel(data: TrainingData, blocks: BlocksOfTime) -> Indices:
    """The part (B, n) of its travel in which each joint is in each block, on average."""
    sums, counts = np.zeros((blocks.count, data.n)), np.zeros(blocks.count)
    for run, block in zip(data.runs, blocks.owners, strict=True):
        np.add.at(sums, block, run.averaged(run.q))
        np.add.at(counts, block, 1.0)
    places = sums / np.maximum(counts, 1.0)[:, None]
    ranks = places.argsort(axis=0).argsort(axis=0)
    return np.asarray(ranks * min(_PARTS, blocks.count) // blocks.count)
