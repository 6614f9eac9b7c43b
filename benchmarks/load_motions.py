"""Loads told by a planned motion of ten seconds, and by the shortest one, on a UR10 and a Panda.

The robot alone is identified from four motions in MuJoCo; a motion for the load is planned on top
of that fit, and played with payloads of 1 to 5 kg (Panda: to 3). Errors of mass and centre, and
whether the 95 % intervals hold the truth.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.battery.motions import CONFIGS, arm, four_motions
from benchmarks.known_payload import friction_of, payload_of
from excite_cli.api.load_planning import SECONDS, LoadProblem, plan_load
from excite_cli.api.loading import load_case
from excite_cli.api.planning import plan
from excite_cli.config.data_spec import EffectSpec
from excite_cli.identification.identify import identify
from excite_cli.identification.load import LoadIdentification, identify_load
from excite_cli.identification.stored_model import StoredFit
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate, takes_of

_HEAVIEST = {"ur10": 5.0, "panda": 3.0}
_CENTRES = [-0.05, -0.05, 0.02], [0.05, 0.05, 0.12]
_INTERVAL = 1.96


@dataclass(frozen=True)
class Case:
    """Error of the mass (a share) and of the centre [m], and errors over their deviations."""

    mass: float
    centre: float
    z: tuple[float, ...]


def cases(name: str, count: int, seed: int, seconds: tuple[float, ...]) -> tuple[LoadProblem, list]:
    """Robot, noise, friction and fit drawn once, then `count` payloads on one motion."""
    of, rng = arm(name), np.random.default_rng([seed, len(name)])
    robot, last = of.robot, of.robot.n - 1
    rubs = friction_of(robot.n, rng)
    noise = float(rng.uniform(0.005, 0.02))
    first = SimulationSettings(seed=int(rng.integers(2**31)), rate=250.0, torque_noise=noise)
    alone = simulate(robot, four_motions(name, 1, rng), first, rubs).dataset
    declared = tuple(EffectSpec(kind=kind) for kind in ("viscous_friction", "coulomb_friction"))
    spec = of.spec.model_copy(update={"effects": declared})
    found = identify(robot, of.base, alone, spec)
    stored = StoredFit(
        "", "", robot.fingerprint(), found.fit, found.held_out_run, found.error,
        found.training_error, (), (), processing=found.processing.as_data(),
    )  # fmt: skip
    case = replace(load_case(CONFIGS / f"{name}.yaml"), spec=spec)
    planned = plan_load(case, stored, seconds=seconds, tell=lambda note: None)
    (motion,) = plan(planned.problem, tell=lambda note: None).motions
    played = PlannedMotion("load", planned.problem.trajectory, motion.coefficients)
    loads = [
        (float(rng.uniform(1.0, _HEAVIEST[name])), rng.uniform(*_CENTRES)) for _ in range(count)
    ]
    # The same robot: its inertias are drawn from the first seed. Every take has noise of its own.
    takes = takes_of((played,), count)["load"]
    effects = [
        *rubs,
        *(
            payload_of(last, mass, centre, run)
            for run, (mass, centre) in zip(takes, loads, strict=True)
        ),
    ]
    data = simulate(robot, (played,), replace(first, repeat=count), effects).dataset
    rows = [
        _case(identify_load(robot, of.base, replace(data, runs=(run,)), spec, stored), *load)
        for run, load in zip(data.runs, loads, strict=True)
    ]
    return planned, rows


def _case(found: LoadIdentification, mass: float, centre: np.ndarray) -> Case:
    told = found.parameters
    errors = [told[n].value - x for n, x in zip(("cx", "cy", "cz"), centre, strict=True)]
    pairs = [(told["mass"].value - mass, told["mass"].std)]
    pairs += [(e, told[n].std) for n, e in zip(("cx", "cy", "cz"), errors, strict=True)]
    return Case(
        told["mass"].value / mass - 1.0,
        float(np.linalg.norm(errors)),
        tuple(e / s for e, s in pairs),
    )


def main() -> None:
    """Print a row per case: robots, fits, payloads and noise are all drawn anew."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    for seconds in ((10.0,), SECONDS):
        found = []
        for k in range(arguments.cases):
            name = list(_HEAVIEST)[k % 2]
            planned, (one,) = cases(name, 1, 1000 * arguments.seed + k, seconds)
            found.append(one)
            told = planned.expected
            print(
                f"{k:4d} {name:6s} {planned.problem.trajectory.duration:4.3g} s, expected "
                f"± {1e3 * told.mass_std:.2g} g, {1e3 * told.center_std:.2g} mm of 1 kg: mass "
                f"{one.mass:+.2%}, centre {1e3 * one.centre:.2f} mm off, z "
                f"{', '.join(f'{z:+.1f}' for z in one.z)}",
                flush=True,
            )
        z = np.abs([each.z for each in found])
        print(
            f"{len(found)} payloads: mass within {max(abs(e.mass) for e in found):.2%}, centre "
            f"within {1e3 * max(e.centre for e in found):.2f} mm, intervals hold "
            f"{np.sum(z <= _INTERVAL)} of {z.size} ({np.mean(z <= _INTERVAL):.1%})\n"
        )


if __name__ == "__main__":
    main()
