"""A motion that the robot's work may ask of it, whatever the recordings show of it.

Recordings show a part of what a robot can do. Where a joint crept, nothing is known of what it does
at speed, however well every second of the recording is predicted. So sizes are judged along this
motion as well (`reach`, `elsewhere`).
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.declared_model import Model
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.regression import effect_columns
from excite_cli.robot.model import Array, Robot

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

    def gram(self, model: Model, effects: Sequence[Effect]) -> Array:
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

    def squares(self, effect: Effect) -> Array:
        """Mean over time (rows, p, p) of products of the columns: θᵀ S θ is the mean square."""
        columns = effect.columns(self.signals)
        return np.asarray(np.einsum("trp,trq->rpq", columns, columns) / len(columns))
