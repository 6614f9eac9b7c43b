"""The one comparison: does a model predict data left out better than another?

The training data are cut into blocks b of a second (`blocks`), and each is predicted by models
fitted without it: to the other blocks of all runs, or, where a new recording is to be predicted, to
the other runs alone. With E_jb the energy that is left on joint j,

    d_b = Σ_j log((E_jb(S) + ε_j) / (E_jb(S') + ε_j)),    D = Σ_b d_b,    s² = B · var(d_b):

the log-likelihood that is gained where the noise of a block is what is left of it, and its standard
error. The same blocks are in both, so that what no model explains does not count, and the logarithm
makes blocks alike in which there is more or less of the same. Next to nothing is left of a block in
which a joint hardly moves, and that says nothing: ε_j is a twentieth of what S' leaves of an
average block. S' is better where D > t s, t of Student's distribution with B − 1 degrees of freedom
at the one confidence.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from excite_cli.diagnosis.blocks import Blocks
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import Columns, TrainingData
from excite_cli.robot.model import Array

CONFIDENCE = 0.6
_LEAST = 0.05
SECONDS = 1.0  # of a block: beyond the memory of what is left, of real arms 0.1 to 0.5 s
_MOST = 96  # blocks: of an hour-long log they are longer
_GROUPS = 8  # of blocks that are left out together


@dataclass(frozen=True)
class Difference:
    """By how much the second model predicts better, the standard error of that, and B."""

    size: float
    error: float
    blocks: int

    @property
    def better(self) -> bool:
        """Whether the second is better with the one confidence that is asked for."""
        return self.size > float(student.ppf(CONFIDENCE, self.blocks - 1)) * self.error

    @property
    def clearness(self) -> float:
        """Size over error."""
        return self.size / max(self.error, 1e-300)


class Comparison:
    """Compares models of some candidates: on the filtered torque, and on the whitened one.

    An effect near the noise shows in the whitened torque only; so the clearer of both counts.
    """

    def __init__(
        self,
        data: TrainingData,
        candidates: Sequence[Columns],
        members: Collection[int],
        levels: Array,
        noise: NoiseModel,
    ) -> None:
        """Of models of the `members` of the candidates; `levels` (n,) [N·m] weigh the joints."""
        given = data, candidates, members
        self._plain = _seconds(*given, NoiseModel.white(levels))
        self._white = _seconds(*given, noise)

    def difference(self, one: Sequence[int], other: Sequence[int]) -> Difference:
        """How much better `other` predicts than `one`."""
        found = [
            _difference(each.in_turn.energies(one), each.in_turn.energies(other))
            for each in (self._plain, self._white)
        ]
        return max(found, key=lambda each: each.clearness)

    def needed(self, chosen: Sequence[int]) -> dict[int, Difference]:
        """How much better the chosen ones predict than without one, of each of them."""
        found: dict[int, Difference] = {}
        for each in (self._plain.in_turn, self._white.in_turn):
            after = each.energies(chosen)
            for i, before in each.without_each(chosen).items():
                own = _difference(before, after)
                if i not in found or own.clearness > found[i].clearness:
                    found[i] = own
        return found

    def as_new(self, one: Sequence[int], other: Sequence[int]) -> Difference:
        """How much better `other` predicts the filtered torque of new recordings."""
        return _difference(*map(self._plain.new.energies, (one, other)))

    def error_of_new(self, chosen: Sequence[int]) -> float:
        """Mean over the joints of the logarithm of the RMS that is left of new recordings."""
        energies = self._plain.new.energies(chosen)
        return 0.5 * float(np.mean(np.log(energies.sum(axis=1) + 1e-300)))


def _difference(before: Array, after: Array) -> Difference:
    blocks = before.shape[1]
    least = _LEAST * after.mean(axis=1, keepdims=True) + 1e-300
    gained: Array = np.log((before + least) / (after + least)).sum(axis=0)
    error = float(np.sqrt(blocks) * gained.std(ddof=1)) if blocks > 1 else np.inf
    return Difference(float(gained.sum()), error, blocks)


@dataclass(frozen=True)
class _Seconds:
    """Blocks of a second of the data: fitted to the others of all runs (`in_turn`), or runs."""

    in_turn: Blocks
    new: Blocks


def _seconds(
    data: TrainingData, candidates: Sequence[Columns], members: Collection[int], noise: NoiseModel
) -> _Seconds:
    """Of models of the `members` of the candidates, rows whitened by `noise`.

    What one run alone carries is known from its blocks in turn; a new recording knows nothing of
    it, and is predicted from the other folds.
    """
    order = sorted(members)
    chosen = [candidates[i] for i in order]
    fixed = data.declared[0].shape[2]
    ends = fixed + np.cumsum([0, *(c.width for c in chosen)])
    own = {i: np.arange(*pair) for i, pair in zip(order, pairwise(ends), strict=True)}
    size = int(ends[-1])
    owner, folds = _cut(data)
    active, grams = [], []
    for joint in range(data.n):
        rows = data.rows_of(chosen, joint)
        of_joint = np.zeros((len(folds), len(rows.active) + 1, len(rows.active) + 1))
        for blocks, usable, block in zip(rows.blocks, rows.usable, owner, strict=True):
            white = noise.whitened(np.concatenate(blocks, axis=1), joint, usable)
            for b in np.unique(block[usable]):
                part = white[block[usable] == b]
                of_joint[b] += part.T @ part
        active.append(np.append(rows.active, size))
        grams.append(of_joint)
    total = np.zeros((size + 1, size + 1))
    if data.prior is not None:
        known = np.append(np.arange(fixed), size)
        total[np.ix_(known, known)] += data.prior
    for at, of_joint in zip(active, grams, strict=True):
        total[np.ix_(at, at)] += of_joint.sum(axis=0)
    norms = np.sqrt(np.diag(total))
    norms[norms < 1e-100] = 1.0
    norms[-1] = 1.0
    total /= np.outer(norms, norms)
    grams = [each / np.outer(norms[at], norms[at]) for at, each in zip(active, grams, strict=True)]

    def columns(some: Sequence[int]) -> NDArray[np.intp]:
        return np.concatenate([np.arange(fixed), *(own[i] for i in some)]).astype(np.intp)

    turns = np.arange(len(folds)) % min(_GROUPS, max(len(folds) // 2, 2))
    given = active, grams, total, columns, own.__getitem__
    return _Seconds(Blocks(*given, turns), Blocks(*given, folds))


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
