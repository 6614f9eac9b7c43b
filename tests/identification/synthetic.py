"""Measured motions with a known truth, made without any simulator: τ = Y φ + effects + noise."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from excite_cli.config.data_spec import FilterSpec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import (
    Regression,
    build_regression,
    effect_columns,
)
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot

RATE = 100.0


def motion(robot: Robot, seconds: float, seed: int) -> tuple[Array, Array, Array, Array]:
    """t, q, v, a of a sum of sines, different for every joint."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / RATE)
    frequency = rng.uniform(0.6, 4.0, (4, robot.n))
    phase = rng.uniform(0, 2 * np.pi, (4, robot.n))
    size = rng.uniform(0.2, 0.5, (4, robot.n)) / frequency**0.5
    inside = frequency * t[:, None, None] + phase
    q = (size * np.sin(inside)).sum(axis=1)
    v = (size * frequency * np.cos(inside)).sum(axis=1)
    return t, q, v, -(size * frequency**2 * np.sin(inside)).sum(axis=1)


def measured(
    robot: Robot,
    phi: Array,
    effects: Sequence[Effect] = (),
    values: Array | None = None,
    noise: float = 0.0,
    seconds: float = 12.0,
    seeds: Sequence[int] = (1, 2),
    memory: float = 0.0,
    still: int | None = None,
) -> Dataset:
    """Runs r1, r2 …; `noise` [N·m] is autoregressive with coefficient `memory`.

    Joint `still` does not move.
    """
    runs = []
    for k, seed in enumerate(seeds):
        t, q, v, a = motion(robot, seconds, seed)
        if still is not None:
            q[:, still], v[:, still], a[:, still] = 0.3, 0.0, 0.0
        tau = torque(robot, phi, effects, values, t, q, v, a, f"r{k + 1}")
        rng = np.random.default_rng([seed, 99])
        white = rng.normal(size=tau.shape) * noise * np.sqrt(1 - memory**2)
        runs.append(Run(f"r{k + 1}", t, q, tau + lfilter([1.0], [1.0, -memory], white, axis=0)))
    return Dataset(robot.joint_names, tuple(runs))


def torque(
    robot: Robot,
    phi: Array,
    effects: Sequence[Effect],
    values: Array | None,
    t: Array,
    q: Array,
    v: Array,
    a: Array,
    name: str,
) -> Array:
    body = RigidBody(robot, phi, q, v, a)
    if values is None or not effects:
        return body.load
    signals = Signals(t, q, v, a, body.load, body.load, body, RunId(name))
    return body.load + effect_columns(effects, signals) @ values


def regression_of(robot: Robot, dataset: Dataset, effects: Sequence[Effect] = ()) -> Regression:
    """As the program makes it, with filters chosen from the data."""
    processing = choose_processing(dataset.runs, FilterSpec())
    prepared = [prepare(run, processing) for run in dataset.runs]
    return build_regression(robot, find_base_parameters(robot), effects, prepared)
