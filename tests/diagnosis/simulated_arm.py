"""Short runs of the smoke arm in MuJoCo, with planted effects, and what is told of them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import declared_effects, kind_named
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import build_robot
from tests.cli.program import SMOKE

pytest.importorskip("mujoco")

from excite_cli.simulation.ground_truth import PlantedEffect, plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation, simulate
from excite_cli.trajectory.fourier import FourierTrajectory

YAW, PITCH, ELBOW, _, SLIDE = range(5)
ROBOT = build_robot(load_spec(SMOKE).robot, SMOKE.parent)
BASE = find_base_parameters(ROBOT)


def motion(number: int, seconds: float = 5.0) -> PlannedMotion:
    rng = np.random.default_rng(number)
    trajectory = FourierTrajectory(4, 2 * np.pi / seconds)
    lower, upper = ROBOT.limits.ranges()
    coefficients = rng.normal(size=(trajectory.n_coefficients, ROBOT.n)) * 0.04 * (upper - lower)
    coefficients[-1] = (lower + upper) / 2
    return PlannedMotion(f"r{number}", trajectory, coefficients)


def planted(
    kind: str, joints: int | tuple[int, ...], value: float, *runs: int, **others: float
) -> PlantedEffect:
    """In all runs if none is named."""
    on = (joints,) if isinstance(joints, int) else joints
    one = plant(kind_named(kind), on, value, others)
    return replace(one, effect=replace(one.effect, runs=tuple(f"r{k}" for k in runs)))


def simulated(
    effects: Sequence[PlantedEffect],
    runs: Sequence[int] = (1, 2, 3),
    seconds: float = 5.0,
    rate: float = 200.0,
    declared: str = "",
    **settings: Any,
) -> Simulation:
    """`declared`: kinds that the robot has on all joints beside what is planted."""
    given = load_spec(SMOKE, [f"effects={declared}"] if declared else []).effects
    how = SimulationSettings(rate=rate, lead_in=0.5, **settings)
    motions = [motion(number, seconds) for number in runs]
    return simulate(ROBOT, motions, how, effects, declared_effects(given, ROBOT))


def played(effects: Sequence[PlantedEffect], *how: Any, **settings: Any) -> Dataset:
    return simulated(effects, *how, **settings).dataset


def told(data: Dataset, kinds: str, *keys: str, held_out: str | None = None) -> Diagnosis:
    chosen = kinds if kinds == "all" else f"[{kinds}]"
    spec = load_spec(SMOKE, [f"diagnosis.kinds={chosen}", *keys])
    return diagnose(ROBOT, BASE, data, spec, held_out)
