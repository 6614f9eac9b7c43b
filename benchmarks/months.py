"""Twelve months of a robot in MuJoCo, compared: which friction doubled, since when?

    python -m benchmarks.months [--cases N] [--seed S] [--quiet-ones]

Each month two motions are recorded and identified (viscous and Coulomb friction declared, a column
`temp` in the log). The temperature swings by 10 degrees over the year, and all dry friction with it
by 1 % per degree. The Coulomb friction of one joint doubles in a month from the fourth to the
tenth; with --quiet-ones of none. `excite compare` over the twelve fits must name that joint and
that month, and no other parameter.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.battery.motions import arm, pool, trajectory
from benchmarks.known_payload import friction_of
from excite_cli import Case, Changes, compare, identify
from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.catalogue import kind_named
from excite_cli.simulation.covariate_series import CovariateSeries
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

MONTHS, SWING, PER_DEGREE = 12, 10.0, -0.01
ROBOTS = ("ur10", "panda")


def year(name: str, seed: int, doubles: bool, folder: Path) -> tuple[Changes, str, str]:
    """What is said of the year; joint and month of the truth."""
    of, rng = arm(name), np.random.default_rng([seed, 91, ROBOTS.index(name)])
    n, robot_seed = of.robot.n, int(rng.integers(2**31))
    best = pool(name, int(rng.integers(8)))
    base = friction_of(n, rng)
    joint, month = int(rng.integers(n)), int(rng.integers(3, 10))
    noise, memory = float(rng.uniform(0.005, 0.02)), float(rng.choice([0.0, 0.8]))
    declared = tuple(EffectSpec(kind=kind) for kind in ("viscous_friction", "coulomb_friction"))
    measurement = of.spec.measurement.model_copy(update={"covariates": ("temp",)})
    spec = of.spec.model_copy(update={"effects": declared, "measurement": measurement})
    case, files = Case(spec, Path("configs"), of.robot), []
    phase = rng.uniform(0.0, 2 * np.pi)
    for k in range(MONTHS):
        temp = 25.0 + SWING * np.sin(2 * np.pi * k / MONTHS + phase) + rng.normal()
        effects = list(base)
        for each in base:
            if each.effect.kind != "coulomb_friction":
                continue
            j, size = each.effect.joints[0], float(each.values[0])
            more = size if doubles and j == joint and k >= month else 0.0
            if more:
                effects.append(plant(kind_named("coulomb_friction"), (j,), more))
            slope = (size + more) * PER_DEGREE
            shape = {"reference": 25.0, "curvature": 0.0}
            effects.append(
                plant(kind_named("covariate_friction"), (j,), slope, shape, covariate="temp")
            )
        motions = tuple(
            PlannedMotion(f"motion_{i + 1}", trajectory(), best[int(c)])
            for i, c in enumerate(rng.permutation(len(best))[:2])
        )
        settings = SimulationSettings(
            seed=robot_seed,
            rate=250.0,
            torque_noise=noise * float(rng.uniform(0.9, 1.1)),
            noise_correlation=memory,
            covariates=(CovariateSeries("temp", (0.0, 100.0), (temp, temp + 1.0), 0.1),),
        )
        data = simulate(of.robot, motions, settings, effects).dataset
        runs = tuple(
            replace(run, tau=_renewed(run.tau, noise, memory, [seed, k, i]))
            for i, run in enumerate(data.runs)
        )
        files.append(folder / f"month_{k + 1:02d}.h5")
        identify(case, replace(data, runs=runs), output=files[-1], tell=lambda note: None)
    return compare(files), of.robot.joint_names[joint], f"month_{month + 1:02d}"


def _renewed(tau: np.ndarray, share: float, memory: float, seed: list[int]) -> np.ndarray:
    """More noise of the same kind: the simulator's own is the same every month."""
    rng = np.random.default_rng(seed)
    white = rng.normal(size=tau.shape)
    for k in range(1, len(white)):
        white[k] = memory * white[k - 1] + np.sqrt(1 - memory**2) * white[k]
    return tau + share * np.sqrt(np.mean(np.square(tau), axis=0)) * white


def main() -> None:
    """Print what was said of every year, and the rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quiet-ones", action="store_true", help="nothing changes")
    arguments = parser.parse_args()
    right = false_years = false_ones = parameters = 0
    for k in range(arguments.cases):
        with tempfile.TemporaryDirectory() as folder:
            found, joint, month = year(
                ROBOTS[k % 2], arguments.seed * 1000 + k, not arguments.quiet_ones, Path(folder)
            )
        parameters += len(found.changes)
        wrong = [
            each for each in found.significant
            if arguments.quiet_ones or each.joint != joint or "coulomb" not in each.name
        ]  # fmt: skip
        hits = [each for each in found.significant if each not in wrong and each.since == month]
        right += bool(hits)
        false_years += bool(wrong)
        false_ones += len(wrong)
        told = "; ".join(
            f"{e.name} {e.before:.3g} -> {e.after:.3g} {e.since} p {e.p_value:.1g}"
            for e in found.significant[:4]
        )
        print(f"{k:3d} {ROBOTS[k % 2]:6s} {joint} {month}: {told or 'nothing'}", flush=True)
    if not arguments.quiet_ones:
        print(f"\njoint and month right: {right} of {arguments.cases}")
    print(f"years with a false change: {false_years} of {arguments.cases}")
    print(f"false changes: {false_ones} of {parameters} parameters")


if __name__ == "__main__":
    main()
