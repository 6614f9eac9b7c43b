"""Smooth random motions of random robots, as signals that effects look at."""

import numpy as np

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Signals
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot


def states(robot: Robot, samples: int, step: float, seed: int = 0) -> tuple[Array, ...]:
    """t (T,) and q, v, a (T, n) of one sine per joint."""
    rng = np.random.default_rng(seed)
    t = step * np.arange(samples)
    size, rate, phase = rng.uniform([[0.3], [0.8], [0]], [[1.2], [3.0], [6.0]], (3, robot.n))
    angle = rate * t[:, None] + phase
    return t, size * np.sin(angle), size * rate * np.cos(angle), -size * rate**2 * np.sin(angle)


def signals_at(robot: Robot, t: Array, q: Array, v: Array, a: Array, run: str = "") -> Signals:
    """Signals whose model is the rigid bodies of the URDF alone."""
    body = RigidBody(robot, standard_parameters(robot), q, v, a)
    # A kind that follows a column of the log finds it under no name, unless it is given one.
    column = {"": 20.0 + t + np.sin(3.0 * t)}
    return Signals(t, q, v, a, body.load, body.load, body, RunId(run), covariates=column)


def signals_of(robot: Robot, samples: int = 200, step: float = 0.02, seed: int = 0) -> Signals:
    """Signals along one sine per joint."""
    return signals_at(robot, *states(robot, samples, step, seed))
