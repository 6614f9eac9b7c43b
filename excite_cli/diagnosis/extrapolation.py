"""How far the data reach: what would be large only where they do not is not known from them.

An effect of size θ has the torque C θ in the data and C' θ along a usual motion. Of it, friction,
offset and rotor of the same joint take up what they can: with their columns T and T' and the share
w = `rules.IMAGINED` that a usual motion has beside the data in a fit (`weighted_fit`),

    B = argmin ms(C − T B) + w ms(C' − T' B),   R = C − T B,   R' = C' − T' B.

So the effect adds R θ to the textbook's model in the data, and R' θ along the motion. Where
w ms(R' θ) > ms(R θ), the data have less to say of it than what is imagined. If R' θ is more than
`rules.MUCH` of all torque that was seen of the joint, too, it stands for something else near by:
cables of a wrist that crept over a twentieth of its range predicted every second of two recordings,
and 40 times the torque of a third.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.modelled_run import DeclaredModel
from excite_cli.diagnosis.training import TrainingData
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.regression import effect_columns
from excite_cli.robot.model import Array, Robot

# A motion that the robot's work may ask of it, whatever the recordings show of it.
#
# Recordings show a part of what a robot can do. Where a joint crept, nothing is known of what it
# does at speed, however well every second of the recording is predicted. So sizes are judged along
# this motion as well (`sufficient`).

_SECONDS, _STEP, _PERIOD = 20.0, 0.02, 10.0  # s
_HARMONICS = 5
_REACHED = 0.8  # of the range
_PACE = 0.5  # of the fastest speed
# From zero, rad or m, and rad/s or m/s: limits may be wider, or there are none.
_FARTHEST, _FASTEST = 2.5, 2.5


def is_steady(effect: Effect) -> bool:
    """Whether it is in all runs, and follows neither time nor a column of the log."""
    return not (effect.runs or effect.covariate or "time" in effect.function_of)


class UsualMotion:
    """A sum of harmonics per joint, over most of its range or to half of its fastest speed."""

    def __init__(self, robot: Robot, phi: Array, seen: Sequence[Signals]) -> None:
        """With bodies at φ; never slower than the signals `seen`. A measured base stands still."""
        rng = np.random.default_rng(0)
        t = np.arange(0.0, _SECONDS, _STEP)
        lower, upper = (np.clip(each, -_FARTHEST, _FARTHEST) for each in robot.limits.ranges())
        middle, half = (lower + upper) / 2.0, _REACHED * (upper - lower) / 2.0
        fastest = _PACE * np.minimum(np.abs(robot.limits.velocity), _FASTEST)
        for each in seen:
            fastest = np.maximum(fastest, np.abs(each.v).max(axis=0, initial=0.0))
        q, v, a = (np.zeros((len(t), robot.n)) for _ in range(3))
        w = 2.0 * np.pi / _PERIOD * np.arange(1, _HARMONICS + 1)
        for j in range(robot.base_joints, robot.n):
            size = rng.normal(size=_HARMONICS) / np.arange(1, _HARMONICS + 1)
            angle = np.outer(t, w) + rng.uniform(0.0, 2.0 * np.pi, _HARMONICS)
            way, speed = np.sin(angle) @ size, np.cos(angle) @ (size * w)
            scale = min(half[j] / np.abs(way).max(), fastest[j] / np.abs(speed).max())
            q[:, j], v[:, j] = middle[j] + scale * way, scale * speed
            a[:, j] = -scale * (np.sin(angle) @ (size * w**2))
        body = RigidBody(robot, phi, q, v, a)
        self.signals = Signals(t, q, v, a, body.load, body.load, body)
        self._after = replace(self.signals, start=max((each.start for each in seen), default=0.0))

    def gram(self, model: DeclaredModel, effects: Sequence[Effect]) -> Array:
        """Mean over time (n, k, k) of products of the columns of every joint.

        [base parameters | declared effects | effects]; of what is in some runs only, or follows
        time or a column of the log, these are zero.
        """
        own = [self.signals.body.regressor[:, :, model.base.selection]]
        for effect in (*model.declared, *effects):
            columns = effect_columns([effect] if is_steady(effect) else [], self.signals)
            missing = len(effect.parameters) - columns.shape[2]
            own.append(np.pad(np.nan_to_num(columns), ((0, 0), (0, 0), (0, missing))))
        every = np.concatenate(own, axis=2).swapaxes(0, 1)
        return np.stack([each.T @ each for each in every]) / every.shape[1]

    def columns(self, effect: Effect) -> Array:
        """Columns (T, rows, p) of an effect, at the time of the last recording."""
        return effect.columns(self._after)


def torque_seen(data: TrainingData) -> Array:
    """RMS (n,) of the measured torque where it is fitted."""
    squares = np.zeros(data.n)
    for run in data.runs:
        squares += np.where(run.usable, np.square(run.tau_fit), 0.0).sum(axis=0)
    counts = sum(run.usable.sum(axis=0) for run in data.runs)
    return np.sqrt(squares / np.maximum(counts, 1))


class Reach:
    """Judges fitted sizes of candidates; those `always` known, one joint's each, may be any.

    Nor is anything said of what some runs have, what follows a column of the log, or how bodies and
    the base are: those are known from all joints.
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
        self._plain: dict[int, list[Candidate]] = {}
        for i in always:
            self._plain.setdefault(candidates[i].rows[0], []).append(candidates[i])

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
        unknown = (rules.IMAGINED * usual**2 > seen**2) & (usual > rules.MUCH * torque)
        beyond = np.flatnonzero(unknown)
        if not len(beyond):
            return ""
        k = beyond[np.argmax(usual[beyond])]
        return (
            f"beside friction and offset it would be {usual[k]:.3g} over the joint's range and "
            f"speed, where it is {seen[k]:.3g} in the data and all torque {torque[k]:.3g}"
        )

    def _both(self, c: Candidate) -> tuple[Array, Array] | None:
        """Mean squares (rows, p, p) of R' and of R; None: nothing is said of it."""
        effect = c.effect
        of_joints = effect.scope in ("joint", "pair") and not effect.carried
        if not of_joints or effect.runs or effect.covariate:
            return None
        columns = self._usual.columns(effect)
        if not np.isfinite(columns).all():
            return None
        both = [self._beyond_the_plain(c, k, columns[:, k]) for k in range(len(c.rows))]
        usual, seen = zip(*both, strict=True)
        return np.stack(usual), np.stack(seen)

    def _beyond_the_plain(self, c: Candidate, k: int, usual: Array) -> tuple[Array, Array]:
        """Mean squares (p, p) of R' and R in its row k; `usual` (T, p) are its columns there."""
        joint, width = c.rows[k], usual.shape[1]
        plain = self._plain.get(joint, [])
        along = np.concatenate([usual, *(self._usual.columns(p.effect)[:, 0] for p in plain)], 1)
        gram, count = np.zeros((along.shape[1],) * 2), 0
        for i, run in enumerate(self._data.runs):
            own = [c.columns[i][:, k], *(p.columns[i][:, 0] for p in plain)]
            rows = np.concatenate(own, axis=1)[run.usable[:, joint]]
            gram += rows.T @ rows
            count += len(rows)
        seen, there = gram / max(count, 1), along.T @ along / len(along)
        both = seen + rules.IMAGINED * there
        taken = np.linalg.lstsq(both[width:, width:], both[width:, :width], rcond=None)[0]
        change = np.vstack([np.eye(width), -taken])
        return change.T @ there @ change, change.T @ seen @ change
