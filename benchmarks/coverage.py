"""How often do 95 % intervals of `excite identify` hold the truth? Seven kinds of noise, in MuJoCo.

    python -m benchmarks.coverage [--trials N] [--seed S] [--noises KIND …] [--inertias WORD]

Arms of public URDFs, their inertias 10 % off, with viscous and Coulomb friction on every joint and
a payload on one run, play three motions; each trial adds other noise to the torques (2 % of each
joint's), or to the positions. Told: the share of intervals of ± 1.96 deviations that hold the
truth, of base parameters, of friction and of the payload's mass and first moments; the least share
of a single parameter of a robot over all its motions; and the usual error over its deviation.
"""

import argparse
import os
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.signal import lfilter

from benchmarks.battery.motions import arm, four_motions
from excite_cli.config.data_spec import EffectSpec, FilterSpec, IdentificationSpec
from excite_cli.effects.catalogue import kind_named
from excite_cli.identification.identify import identify
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array
from excite_cli.simulation.ground_truth import plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

ROBOTS = ("ur10", "panda")
RATE, LEVEL, INERTIAS_OFF = 200.0, 0.02, 0.1  # Hz; share of a joint's torque; share of the URDF's
INTERVAL, SETS, LOADED = 1.96, 8, "motion_2"
COUNTS = 4096  # of a turn, by an encoder of 12 bits
LOW = FilterSpec(position=3.0, parallel=1.5)  # Hz; the motions have 1 to 2
FRICTION = ("viscous_friction", "coulomb_friction")
NONE = FilterSpec(position="none", parallel="none")
Made = Callable[[np.random.Generator, int, int], Array]


def correlated(memory: float) -> Made:
    """An autoregression of this coefficient from sample to sample, of unit variance."""

    def made(rng: np.random.Generator, samples: int, joints: int) -> Array:
        white = rng.normal(size=(samples + 1000, joints)) * np.sqrt(1.0 - memory**2)
        return np.asarray(lfilter([1.0], [1.0, -memory], white, axis=0)[1000:])

    return made


def hum(rng: np.random.Generator, samples: int, joints: int) -> Array:
    """On every joint a tone of 0.5 to 4 Hz, and a tenth of it white."""
    t = np.arange(samples)[:, None] / RATE
    frequency, phase = rng.uniform(0.5, 4.0, joints), rng.uniform(0.0, 2.0 * np.pi, joints)
    tone = np.sqrt(2.0) * np.sin(2.0 * np.pi * frequency * t + phase)
    return np.asarray(tone + 0.1 * rng.normal(size=(samples, joints)))


NOISES: dict[str, tuple[Made, FilterSpec, bool]] = {
    "white": (correlated(0.0), FilterSpec(), False),
    "memory 0.9": (correlated(0.9), FilterSpec(), False),
    "memory 0.99": (correlated(0.99), FilterSpec(), False),
    "hum": (hum, FilterSpec(), False),
    "12 bits": (correlated(0.0), FilterSpec(), True),
    "filter too low": (correlated(0.0), LOW, False),
    "no filter": (correlated(0.0), NONE, False),
}


def noisy(data: Dataset, made: Made, coarse: bool, rng: np.random.Generator) -> Dataset:
    """The recordings with noise, and with positions of an encoder of few bits if `coarse`."""
    runs = []
    for run in data.runs:
        size = LEVEL * np.sqrt(np.mean(np.square(run.tau), axis=0))
        tau = run.tau + size * made(rng, *run.tau.shape)
        step = 2.0 * np.pi / COUNTS
        q = step * np.round(run.q / step) if coarse else run.q
        runs.append(Run(run.name, run.t, q, tau))
    return replace(data, runs=tuple(runs))


def scores(
    name: str, number: int, seed: int, trials: int, noise: str, inertias: Any
) -> tuple[list[str], Array]:
    """Names of parameters, and their errors over their deviations (trials, p)."""
    of, rng = arm(name), np.random.default_rng([seed, number, ROBOTS.index(name)])
    motions = four_motions(name, int(rng.integers(8)), rng)[:3]
    joints = of.robot.n
    rubbing = [
        plant(kind_named(kind), (j,), float(rng.uniform(0.5, 5.0)))
        for kind in FRICTION
        for j in range(joints)
    ]
    centre = map(float, rng.uniform([-0.05, -0.05, 0.02], [0.05, 0.05, 0.12]))
    others = dict(zip(("cx", "cy", "cz"), centre, strict=True))
    body = plant(kind_named("payload"), (joints - 1,), float(rng.uniform(1.0, 3.0)), others)
    body = replace(body, effect=replace(body.effect, runs=(LOADED,)))
    settings = SimulationSettings(
        seed=int(rng.integers(2**31)), rate=RATE, torque_noise=0.0, encoder=0.0,
        inertia_error=INERTIAS_OFF,
    )  # fmt: skip
    played = simulate(of.robot, motions, settings, [*rubbing, body])
    on_last = (of.robot.joint_names[-1],)
    effects = (
        *(EffectSpec(kind=kind) for kind in FRICTION),
        EffectSpec(kind="payload", joints=on_last, runs=(LOADED,)),
    )
    made, wanted, coarse = NOISES[noise]
    how = IdentificationSpec(inertias=inertias, consistent=False)
    measurement = of.spec.measurement.model_copy(update={"filter": wanted})
    update = {"effects": effects, "identification": how, "measurement": measurement}
    spec = of.spec.model_copy(update=update)
    known = {f"{p.effect.kind}{p.effect.joints}": p.values for p in (*rubbing, body)}
    found = []
    for _ in range(trials):
        data = noisy(played.dataset, made, coarse, rng)
        fit = identify(of.robot, of.base, data, spec, held_out="motion_3").fit
        own = [known[f"{each.kind}{each.joints}"] for each in fit.effects]
        truth = np.concatenate([of.base.mapping @ played.truth.phi, *own])
        found.append((fit.values - truth) / fit.std)
    groups = ["base"] * fit.rank
    for each in fit.effects:  # of a payload, mass and first moments: the rest hardly shows
        count = len(each.parameters)
        load = ["payload"] * 4 + [""] * (count - 4)
        groups += load if each.kind == "payload" else ["friction"] * count
    return groups, np.array(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=3, help="of each robot and motion")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noises", nargs="+", default=[*NOISES], choices=[*NOISES])
    parser.add_argument("--inertias", default="auto", choices=["auto", "free", "cad"])
    asked = parser.parse_args()
    for noise in asked.noises:
        held: dict[str, list[bool]] = defaultdict(list)
        spread, least = [], 1.0
        for name in ROBOTS:
            of_robot = []
            for number in range(SETS):
                groups, z = scores(name, number, asked.seed, asked.trials, noise, asked.inertias)
                inside = np.abs(z) <= INTERVAL
                for k, group in enumerate(groups):
                    held[group] += list(inside[:, k])
                shown = [k for k, group in enumerate(groups) if group]
                of_robot.append(inside[:, shown])
                spread.append(np.sqrt(np.median(np.square(z[:, shown])) / 0.455))
            least = min(least, float(np.concatenate(of_robot).mean(axis=0).min()))
        told = ", ".join(
            f"{group} {np.mean(inside):.1%} of {len(inside)}"
            for group, inside in held.items()
            if group
        )
        print(f"{noise:15} {told}; least {least:.0%}; usual |z| {np.mean(spread):.2f}", flush=True)


if __name__ == "__main__":
    main()
