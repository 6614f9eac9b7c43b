"""What every effect is worth on data that took no part: the error there with it and without it.

Without it, the model is fitted anew to the training data: so is what refines it left out, which
would take its place. Let e and e' be the errors of the torque with and without it, in block b of
the sealed part and on joint j. The effect removes

    d_b = Σ_j Σ_(t in b) (e'_tj² - e_tj²) / Σ_t (e'_tj² + e_tj²)

so that every joint counts by what is left on it. Whether Σ_b d_b is above or below zero beyond
chance is judged by drawing blocks with replacement. Samples in which a joint stands do not count:
its stiction may be any, and no model says it. Nothing is chosen or fitted by this.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.diagnosis.before_after import FittedModel, Played, refitted
from excite_cli.diagnosis.declared_model import Model
from excite_cli.diagnosis.prediction import Prediction
from excite_cli.diagnosis.records import Removed
from excite_cli.diagnosis.tracing import Traced
from excite_cli.diagnosis.verdict import SealedVerdict
from excite_cli.identification.errors_of_torque import Errors, block_starts, drawn_blocks
from excite_cli.robot.model import Array

_BLOCK = 0.5  # s, longer than what noise of the filtered torque remembers
_FEWEST = 5  # blocks: of fewer, all of them agree by chance too often
_NIL = 1e-6  # of the torque


@dataclass(frozen=True)
class Worth:
    """The verdict on an effect, and by how much it lowers the error, per joint where it does."""

    verdict: SealedVerdict
    removes: dict[str, Removed]


def worth_on_sealed(
    played: Played, model: Model, traced: Traced, after: FittedModel
) -> dict[int, Worth]:
    """Worth of every chosen candidate on the sealed runs `played`, beside all others."""
    with_all = played.predictions(after)
    errors = played.errors(with_all)
    found = {}
    for i in traced.chosen:
        rest = traced.judge.without(i, traced.chosen)
        without = played.predictions(refitted(model, traced, rest))
        errors_without = played.errors(without)
        removed = _removed_by_block(played, without, with_all)
        lower = errors_without.mean_relative - errors.mean_relative
        found[i] = Worth(sealed_verdict(removed, lower), _removes(errors_without, errors))
    return found


def sealed_verdict(removed: Array, lower: float) -> SealedVerdict:
    """Judge an effect by what it removes in every block (B,).

    `lower`: by how much it lowers the mean error over all samples, also where joints stand; a
    verdict that this contradicts is not given.
    """
    if len(removed) < _FEWEST:
        return SealedVerdict.NOT_CONFIRMED
    low, high = np.percentile(drawn_blocks(len(removed)) @ removed, [2.5, 97.5])
    if low > 0.0 and lower > 0.0:
        return SealedVerdict.CONFIRMED
    if high < 0.0 and lower < 0.0:
        return SealedVerdict.HARMFUL
    return SealedVerdict.NOT_CONFIRMED


def _removed_by_block(
    played: Played, without: Sequence[Prediction], with_it: Sequence[Prediction]
) -> Array:
    """d (B,), of the blocks in which a joint moves."""
    blocks = []
    for run, one, other in zip(played.runs, without, with_it, strict=True):
        counts = run.valid & run.moving
        worse, better = (
            np.where(counts, run.tau - run.averaged(each.torque), 0.0) ** 2 for each in (one, other)
        )
        rows = np.stack([worse - better, worse + better, counts])
        blocks.append(np.add.reduceat(rows, block_starts(len(counts), run.step, _BLOCK), axis=1))
    difference, total, count = np.concatenate(blocks, axis=1)
    scale = total.sum(axis=0)
    shares = np.divide(difference, scale, out=np.zeros_like(difference), where=scale > 0.0)
    return np.asarray(shares.sum(axis=1)[count.any(axis=1)])


def _removes(without: Errors, with_it: Errors) -> dict[str, Removed]:
    """What is removed on every joint on which it is not nil."""
    found = {}
    for joint, relative in with_it.relative.items():
        less = without.relative[joint] - relative
        if abs(less) > _NIL:
            found[joint] = Removed(
                less,
                without.relative_moving[joint] - with_it.relative_moving[joint],
                without.rms[joint] - with_it.rms[joint],
            )
    return found
