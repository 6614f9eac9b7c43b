"""Logs of an hour, and a thousand short ones: seconds and peak memory of whole commands.

    python -m benchmarks.long_logs [--folder DIR] [--commands identify,diagnose] [--runs 0]
                                   [--parts 0.1,0.333,1] [--workers 1]

A Panda with friction that grows with load plays six motions of ten minutes in MuJoCo, recorded at
1 kHz (3.6 million samples of 7 joints). The commands are run on a tenth, a third and all of each
recording. Time is linear where seconds over samples stay the same; the goal is 2 GB at most for the
hour. With --runs N the hour is cut into N recordings of ten seconds each (at most 360 of an hour;
more are taken from the start again, with fresh noise of the torque).
"""

import argparse
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

from benchmarks.battery.motions import CONFIGS, arm, pool, trajectory
from benchmarks.program import excite
from excite_cli.effects.catalogue import declared_effects
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.simulation.ground_truth import parse_planted
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

ROBOT, RATE, MOTIONS, PERIODS = "panda", 1000.0, 6, 60
SHORT = 10.0  # s
NOISE = 0.05  # N·m, fresh, of a recording that is taken once more


def recordings(folder: Path) -> list[Path]:
    """Six files of ten minutes each; made where they are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    of, found = arm(ROBOT), []
    planted = parse_planted(f"load_dependent_friction@{of.robot.joint_names[3]}=0.06", of.robot, {})
    declared = declared_effects(of.spec.effects, of.robot)
    for k, coefficients in enumerate(pool(ROBOT, 1)[:MOTIONS], start=1):
        path = folder / f"motion_{k}.h5"
        found.append(path)
        if path.exists():
            continue
        motion = PlannedMotion(f"motion_{k}", trajectory(), coefficients)
        # One seed is one robot; every recording has noise of its own, by its name.
        settings = SimulationSettings(seed=1, rate=RATE, periods=PERIODS, noise_correlation=0.5)
        write_dataset(path, simulate(of.robot, [motion], settings, planted, declared).dataset, {})
    return found


def shares(paths: list[Path], share: float, folder: Path) -> list[Path]:
    """The first `share` of every recording."""
    if share >= 1.0:
        return paths
    found = []
    for path in paths:
        run = _read(path)
        found.append(folder / f"{path.stem}_{share:g}.h5")
        if not found[-1].exists():
            _write(found[-1], run.cut(0, round(share * len(run.t))))
    return found


def short_ones(paths: list[Path], count: int, folder: Path) -> list[Path]:
    """`count` recordings of ten seconds, of all motions in turn."""
    runs, found, rng = [_read(path) for path in paths], [], np.random.default_rng(7)
    size = round(SHORT * RATE)
    each = len(runs[0].t) // size
    for k in range(count):
        take, number = divmod(k, len(runs) * each)
        run = runs[number % len(runs)]
        first = number // len(runs) * size
        cut = run.cut(first, first + size)
        noise = rng.normal(0.0, NOISE, cut.tau.shape) if take else 0.0
        name = f"run_{k:04}"
        found.append(folder / f"{name}.h5")
        _write(found[-1], Run(name, cut.t - cut.t[0], cut.q, cut.tau + noise))
    return found


def _read(path: Path) -> Run:
    with h5py.File(path) as file:
        group = next(iter(file["runs"].values()))
        return Run(path.stem, *(group[name][()] for name in ("t", "q", "tau")))


def _write(path: Path, run: Run) -> None:
    write_dataset(path, Dataset(arm(ROBOT).robot.joint_names, (run,)), {})


def measured(command: str, paths: list[Path], workers: int) -> tuple[float, float]:
    """Seconds, and peak memory [MB] of the command's own process."""
    with tempfile.TemporaryDirectory() as folder:
        line = [command, CONFIGS / f"{ROBOT}.yaml", *paths, "-o", Path(folder) / "found.h5"]
        line += ["--quiet", *(["--workers", str(workers)] if workers > 1 else [])]
        began = time.perf_counter()
        found = excite(*line, good=(0, 1))
    return time.perf_counter() - began, found.memory


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "long_logs")
    parser.add_argument("--commands", default="identify,diagnose")
    parser.add_argument("--parts", default="0.1,0.333,1")
    parser.add_argument("--runs", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    paths = recordings(given.folder)
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        cases = (
            [short_ones(paths, given.runs, Path(folder))]
            if given.runs
            else [shares(paths, float(x), Path(folder)) for x in given.parts.split(",")]
        )
        for command in given.commands.split(","):
            print(f"{command:10} {'files':>6} {'samples':>9} {'seconds':>8} {'us/sample':>10} MB")
            for each in cases:
                samples = sum(len(_read(path).t) for path in each)
                seconds, memory = measured(command, each, given.workers)
                print(f"{'':10} {len(each):6} {samples:9} {seconds:8.1f} "
                      f"{1e6 * seconds / samples:10.1f} {memory:.0f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
