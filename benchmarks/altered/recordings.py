"""Recordings to be altered: simulated ones with a known answer, and those of real robots."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.battery.series import robot_of, series, short_moves
from excite_cli.api.loading import Case
from excite_cli.config.data_spec import EffectSpec
from excite_cli.config.load_spec import load_spec
from excite_cli.effects.catalogue import declared_effects, kind_named
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import build_robot
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

DATA = Path(__file__).parents[2] / "data"
CONFIGS = Path(__file__).parents[2] / "configs"
_RUNS = ("run_1", "run_2", "run_3")
_FRICTION = (EffectSpec(kind="viscous_friction"), EffectSpec(kind="coulomb_friction"))


@dataclass(frozen=True)
class Recording:
    """Data as a sound file holds them, and the config they belong to."""

    name: str
    case: Case
    data: Dataset


@cache
def recording(name: str) -> Recording:
    """One of `NAMES`."""
    return _MAKERS[name](name)


def _simulated(name: str) -> Recording:
    robot, moves, kind, joint, size, rate = _SIMULATED[name]
    of = robot_of(robot)
    rng = np.random.default_rng([sum(map(ord, name)), 16])
    motions = (short_moves if moves else series)(of, _RUNS, rng)
    spec = of.spec.model_copy(update={"effects": _FRICTION})
    played = simulate(
        of.robot,
        motions,
        SimulationSettings(seed=3, rate=rate),
        [plant(kind_named(kind), (joint,), size)],
        declared_effects(_FRICTION, of.robot),
    )
    runs = tuple(replace(run, extra={}) for run in played.dataset.runs)
    return Recording(name, Case(spec, CONFIGS, of.robot), replace(played.dataset, runs=runs))


def _real(name: str) -> Recording:
    """In N·m, as its config converts it."""
    folder = DATA / name
    spec = load_spec(folder / f"{name}.yaml", [])
    robot = build_robot(spec.robot, folder)
    data = read_dataset([folder / f"{name}.h5"], spec.measurement, robot.joint_names)
    runs = tuple(replace(run, extra={}) for run in data.runs)
    return Recording(name, Case(spec, folder, robot), replace(data, runs=runs, findings=()))


_SIMULATED: dict[str, tuple[str, bool, str, int, float, float]] = {
    "ur10": ("ur10", False, "load_dependent_friction", 2, 0.08, 250.0),
    "panda": ("panda", False, "spring", 3, 12.0, 500.0),
    "ur10_moves": ("ur10", True, "torque_offset", 1, 6.0, 250.0),
}
REAL = ("kr300", "ur10_cb", "tx40", "med7")
_MAKERS: dict[str, Callable[[str], Recording]] = {
    **dict.fromkeys(_SIMULATED, _simulated),
    **dict.fromkeys(REAL, _real),
}
NAMES = tuple(_MAKERS)
