"""Recorded torques played on exported models: how far do they drift, before and after?

    python -m benchmarks.replay [--seed S]

Six robots of the campaigns in MuJoCo, inertias 10 to 30 % off their URDF, with viscous, Coulomb and
load-dependent friction, a spring on one joint and an armature on another, four motions each. They
are diagnosed, exported, and `excite replay` plays the held-out motion's torques on the URDF and on
the exported model.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.campaigns.motions import series
from benchmarks.campaigns.robots import ROBOTS, robot_of
from benchmarks.known_payload import friction_of
from excite_cli import Case, diagnose, replay
from excite_cli.effects.catalogue import kind_named
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

RUNS = tuple(f"run_{k}" for k in range(1, 5))


def main() -> None:
    """Print deviations per robot."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    print("robot       joints   mean over joints, URDF   exported model   worst joint")
    for k, name in enumerate(ROBOTS):
        of, rng = robot_of(name), np.random.default_rng([arguments.seed, k])
        n, usual = of.robot.n, np.median(of.robot.limits.effort)
        small = float(np.clip(usual / 100.0, 0.05, 1.0))
        effects = [
            *(plant(each.effect.__class__, each.effect.joints, small * float(each.values[0]))
              for each in friction_of(n, rng)),
            *(plant(kind_named("load_dependent_friction"), (j,), float(rng.uniform(0.03, 0.12)))
              for j in range(n)),
            plant(kind_named("spring"), (int(rng.integers(n)),), 5.0 * small),
            plant(kind_named("armature"), (int(rng.integers(n)),), 0.05 * small),
        ]  # fmt: skip
        settings = SimulationSettings(seed=int(rng.integers(2**31)), rate=250.0)
        data = simulate(of.robot, series(of, RUNS, rng), settings, effects).dataset
        with tempfile.TemporaryDirectory() as folder:
            file, case = Path(folder) / "found.h5", Case(of.spec, Path("configs"), of.robot)
            diagnose(case, data, output=file, tell=lambda note: None)
            found = replay(file, data, held_out=True, tell=lambda note: None)
        before, after = found.means
        worst = max(found.after, key=lambda joint: found.after[joint])
        told = "-" if before is None else f"{1e3 * before:.2f} mrad"
        print(
            f"{name:11s} {n:6d}   {told:>22s}   {1e3 * after:9.2f} mrad   "
            f"{1e3 * found.after[worst]:.2f} mrad ({worst}){' LOST' if found.lost else ''}",
            flush=True,
        )


if __name__ == "__main__":
    main()
