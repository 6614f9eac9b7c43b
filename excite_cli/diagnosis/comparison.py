"""The one comparison: does a model predict data left out better than another?

The training data are cut into blocks b. Every block is predicted by models fitted to the other
folds, as a new recording would be, or, where a model has effects of single runs, to the other
blocks of all runs. With E_jb the energy that is left on joint j,

    d_b = Σ_j (E_jb(S) − E_jb(S')) / (Σ_b E_jb(S') / B),    D = Σ_b d_b,    s² = B · var(d_b):

in units of what S' leaves of an average block. S' is better where D exceeds s, its standard error.
The same blocks are in both, so that what no model explains does not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.judgement import Judgement
from excite_cli.robot.model import Array

# Standard errors that a difference must have. With 2 the answers on logs of real robots got worse:
# TX40 8.0 to 10.2 % of the torque left, Med 7 21 to 57 %.
CONFIDENCE = 1.0


@dataclass(frozen=True)
class Difference:
    """By how much the second model predicts better, and the standard error of that."""

    size: float
    error: float

    @property
    def better(self) -> bool:
        """Whether the second is better with the one confidence that is asked for."""
        return self.size > CONFIDENCE * self.error


def difference(judge: Judgement, one: Sequence[int], other: Sequence[int]) -> Difference:
    """How much better `other` predicts than `one`: the clearer of filtered and whitened torque.

    An effect near the noise shows in the whitened torque only.
    """
    single = any(judge.candidates[i].effect.runs for i in {*one, *other})
    found = [_difference(each, one, other, single) for each in (judge.plain, judge.white)]
    return max(found, key=lambda each: each.size / max(each.error, 1e-300))


def as_new(judge: Judgement, one: Sequence[int], other: Sequence[int]) -> Difference:
    """The same of the filtered torque of new recordings, whatever the models differ in."""
    return _difference(judge.plain, one, other, single=False)


def left_out(evidence: Evidence, chosen: Sequence[int]) -> float:
    """Mean over the joints of the logarithm of the RMS that is left of new recordings."""
    return 0.5 * float(np.mean(np.log(evidence.as_new(chosen).sum(axis=1) + 1e-300)))


def _difference(
    evidence: Evidence, one: Sequence[int], other: Sequence[int], single: bool
) -> Difference:
    energies = evidence.on_sides if single else evidence.as_new
    before, after = energies(one), energies(other)
    blocks = before.shape[1]
    unit = np.maximum(after.mean(axis=1, keepdims=True), 1e-300)
    gained: Array = ((before - after) / unit).sum(axis=0)
    return Difference(float(gained.sum()), float(np.sqrt(blocks) * gained.std(ddof=1)))
