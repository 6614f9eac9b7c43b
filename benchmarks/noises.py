"""The loop of docs/results.md in other noises: whether a name comes or goes.

    python -m benchmarks.noises [--noises N]

Motions are planned and played as `make loop` does. The same robot is then recorded N times with
noise of its own, and diagnosed from the file each time; the names of all are printed.
"""

import argparse
import os
import tempfile
from collections import Counter
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from threadpoolctl import threadpool_limits

from benchmarks.campaigns.instruments import Instruments, recorded
from benchmarks.problems import CONFIGS
from excite_cli.api.diagnosing import diagnose
from excite_cli.api.loading import load_problem
from excite_cli.api.planning import plan
from excite_cli.api.simulating import simulate
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.simulation.settings import SimulationSettings

_EFFECT = "load_dependent_friction@elbow_joint=0.06"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--noises", type=int, default=20)
    count = parser.parse_args().noises
    noise = SimulationSettings().torque_noise
    sets: Counter[tuple[str, ...]] = Counter()
    with threadpool_limits(1), tempfile.TemporaryDirectory() as folder:
        problem = load_problem(CONFIGS / "ur10.yaml", ["sequence.motions=4"])
        silent = SimulationSettings(torque_noise=0.0)
        played = simulate(problem, plan(problem), [_EFFECT], silent).dataset
        for seed in range(1, count + 1):
            path = Path(folder) / f"{seed}.h5"
            write_dataset(path, recorded(played, Instruments(seed, noise)).dataset, {})
            found = diagnose(problem, path, tell=lambda note: None)
            names = tuple(sorted(f"{e.effect.kind}@{'+'.join(e.effect.joints)}"
                                 for e in found.effects))  # fmt: skip
            sets[names] += 1
            print(
                f"noise {seed:3}: {', '.join(names) or 'nothing'}; held out "
                f"{100 * found.before.mean_relative:.2f} -> "
                f"{100 * found.after.mean_relative:.2f} %",
                flush=True,
            )
    for names, times in sets.most_common():
        print(f"{times:3} of {count}: {', '.join(names) or 'nothing'}")


if __name__ == "__main__":
    main()
