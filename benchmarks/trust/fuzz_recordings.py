"""Valid measured data that inputs are made from, and what a command does with a measured file."""

from pathlib import Path

import numpy as np

from benchmarks.trust.fuzz_mutations import Rng, chance, pick
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Array, Dataset
from excite_cli.measurement.motion_files import motion_reader_for, read_motion
from excite_cli.measurement.quality import raise_for_errors

JOINTS = ("shoulder", "elbow", "wrist")
_BOUNDS = (np.full(3, -3.0), np.full(3, 3.0), np.full(3, 4.0), np.full(3, 50.0))
_TURNING = np.array([1.0, 1.0, 0.0])
# What a config may declare of the files.
SPECS = (
    MeasurementSpec(),
    MeasurementSpec(rate=100.0, time="ms", angle="deg"),
    MeasurementSpec(channels={"tau": "current", "dq": None}, torque="current"),
    MeasurementSpec(names={"1": "shoulder", "2": "elbow", "3": "wrist"}),
)


def recorded(rng: Rng, samples: int = 120, rate: float = 100.0) -> dict[str, Array]:
    """t (T,), q, dq, tau (T, 3) of a smooth motion with noise."""
    t = np.arange(samples) / rate
    speed, phase = np.array([2.0, 2.9, 3.7]), np.array([0.0, 0.7, 1.9])
    angle = np.outer(t, speed) + phase
    q, dq = np.sin(angle), speed * np.cos(angle)
    tau = 12 * np.cos(q) + 0.4 * dq + rng.normal(0, 0.1, q.shape)
    return {"t": t, "q": q, "dq": dq, "tau": tau}


def enter_data(path: Path) -> Dataset:
    """As `diagnose` and `identify`: read, convert, check."""
    kind = path.stat().st_size % 8 if path.is_file() else 0
    spec = SPECS[kind] if kind < len(SPECS) else SPECS[0]
    data = read_dataset([path], spec, JOINTS, _BOUNDS, _TURNING)
    raise_for_errors(data)
    for run in data.runs:
        whole = [np.isfinite(x).all() for x in (run.t, run.q, run.tau)]
        if not all(whole) or not (np.diff(run.t) > 0).all():
            raise AssertionError(f"a run with {whole} passed all checks")
    return data


def enter_motion(path: Path) -> bool:
    """As `check` and `view`: a motion, if the file is one."""
    if motion_reader_for(path) is None:
        return False
    read_motion(path, JOINTS)
    return True


def odd_samples(rng: Rng, data: dict[str, Array]) -> dict[str, Array]:
    """Columns with NaN, jumps, constants, huge or tiny values, time that goes back or stands."""
    data = {name: array.copy() for name, array in data.items()}
    for _ in range(int(rng.integers(1, 4))):
        name = pick(rng, list(data))
        flat = data[name].reshape(len(data[name]), -1)
        column = flat[:, int(rng.integers(flat.shape[1]))]
        rows = rng.random(len(column)) < pick(rng, (0.01, 0.2, 0.9, 1.1))
        value = pick(rng, (np.nan, np.inf, -np.inf, 0.0, 1e308, -1e308, 1e-308, 5e-324, 1e18, 7.0))
        way = int(rng.integers(6))
        if way == 0:
            column[rows] = value
        elif way == 1:
            column[:] = column[::-1].copy()
        elif way == 2:
            with np.errstate(over="ignore", under="ignore", invalid="ignore"):
                column *= value
        elif way == 3:
            column[:] = rng.permutation(column)
        elif way == 4:
            column[:] = np.round(column, int(rng.integers(-2, 3)))
        else:
            column += pick(rng, (1.7e9, 1e6, -1e12, value))
    if chance(rng, 0.2):
        most = int(pick(rng, (0, 1, 2, 9, 10, 11)))
        data = {name: array[:most] for name, array in data.items()}
    return data
