"""How far the data reach: what would be large only where they do not is not known from them.

An effect of size θ has the torque C(θ) in the data and C'(θ) along a usual motion. Where
RMS C' > 3 RMS C and RMS C' is more than half of all torque that was seen of the joint, it stands
for something else near by: cables of a wrist that crept over a twentieth of its range predicted
every second of two recordings, and 40 times the torque of a third.
"""

from collections.abc import Collection, Sequence

import numpy as np

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.training import TrainingData
from excite_cli.diagnosis.usual_motion import UsualMotion, is_steady
from excite_cli.robot.model import Array


def torque_seen(data: TrainingData) -> Array:
    """RMS (n,) of the measured torque where it is fitted."""
    squares = np.zeros(data.n)
    for run in data.runs:
        squares += np.where(run.usable, np.square(run.tau_fit), 0.0).sum(axis=0)
    counts = sum(run.usable.sum(axis=0) for run in data.runs)
    return np.sqrt(squares / np.maximum(counts, 1))


class Reach:
    """Judges fitted sizes of candidates; those `always` known, which every robot has, may be any.

    Nor is anything said of what some runs have, what follows time or a column of the log, or how
    bodies and the base are: those are known from all joints.
    """

    def __init__(
        self,
        candidates: Sequence[Candidate],
        data: TrainingData,
        usual: UsualMotion,
        always: Collection[int] = (),
    ) -> None:
        self._candidates, self._data, self._usual = candidates, data, usual
        self._torque = torque_seen(data)
        self._squares: dict[int, tuple[Array, Array] | None] = dict.fromkeys(always)

    def why_not(self, i: int, values: Array) -> str:
        """Why candidate i cannot be known to be of these values; empty if it can."""
        if i not in self._squares:
            self._squares[i] = self._both(self._candidates[i])
        found = self._squares[i]
        if found is None:
            return ""
        usual, seen = (
            np.sqrt(np.maximum(np.einsum("rpq,p,q->r", each, values, values), 0.0))
            for each in found
        )
        torque = self._torque[list(self._candidates[i].rows)]
        beyond = np.flatnonzero((usual > rules.FARTHER * seen) & (usual > rules.MUCH * torque))
        if not len(beyond):
            return ""
        k = beyond[np.argmax(usual[beyond])]
        return (
            f"its torque would be {usual[k]:.3g} over the joint's range and speed, where it is "
            f"{seen[k]:.3g} in the data and all torque {torque[k]:.3g}"
        )

    def _both(self, c: Candidate) -> tuple[Array, Array] | None:
        """Mean squares along the usual motion and in the data; None: nothing is said of it."""
        effect = c.effect
        of_joints = effect.scope in ("joint", "pair") and not effect.carried
        if not (of_joints and is_steady(effect)):
            return None
        usual = self._usual.squares(effect)
        if not np.isfinite(usual).all():
            return None
        seen, counts = np.zeros_like(usual), np.zeros(len(c.rows))
        for columns, run in zip(c.columns, self._data.runs, strict=True):
            usable = run.usable[:, list(c.rows)]
            own = columns * usable[:, :, None]
            seen += np.einsum("trp,trq->rpq", own, own)
            counts += usable.sum(axis=0)
        return usual, seen / np.maximum(counts, 1)[:, None, None]
