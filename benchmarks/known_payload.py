"""Payloads of 1 to 5 kg on a UR10 and a Panda whose torques have unknown gains of ±10 %.

Four motions of ten seconds in MuJoCo: unloaded, with a payload that was weighed, with an unknown
one, unloaded (held out). The unknown mass with the known payload and without it: error, and whether
the 95 % interval holds the truth; likewise every gain.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.battery.motions import arm, four_motions
from excite_cli.config.data_spec import EffectSpec, IdentificationSpec, KnownPayloadSpec
from excite_cli.effects.catalogue import kind_named
from excite_cli.effects.parameter import Value
from excite_cli.identification.identify import Identification, identify
from excite_cli.robot.model import Array
from excite_cli.simulation.ground_truth import Planted, plant
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

ROBOTS = ("ur10", "panda")
WEIGHED, UNKNOWN = "motion_2", "motion_3"
_INTERVAL = 1.96
_FRICTION = ("viscous_friction", "coulomb_friction")


@dataclass(frozen=True)
class Case:
    """Relative error of the unknown mass, and errors over their deviation."""

    robot: str
    mass: float
    known_error: float
    known_z: float
    assumed_error: float
    assumed_z: float
    gains_z: tuple[float, ...]


def case(name: str, seed: int) -> Case:
    """One robot, its gains, payloads, noise and motions all drawn from the seed."""
    of, rng = arm(name), np.random.default_rng([seed, ROBOTS.index(name)])
    last, joints = of.robot.n - 1, range(of.robot.n)
    weighed, mass = rng.uniform(1.0, 5.0, 2)
    centres = rng.uniform([-0.05, -0.05, 0.02], [0.05, 0.05, 0.12], (2, 3))
    gains = rng.uniform(-0.1, 0.1, of.robot.n)
    motions = four_motions(name, int(rng.integers(8)), rng)
    effects = [
        *friction_of(of.robot.n, rng),
        *(plant(kind_named("torque_gain"), (j,), float(gains[j])) for j in joints),
        payload_of(last, weighed, centres[0], WEIGHED),
        payload_of(last, mass, centres[1], UNKNOWN),
    ]  # fmt: skip
    settings = SimulationSettings(
        seed=int(rng.integers(2**31)),
        rate=250.0,
        torque_noise=float(rng.uniform(0.005, 0.02)),
        noise_correlation=float(rng.choice([0.0, 0.8])),
    )
    data = simulate(of.robot, motions, settings, effects).dataset
    declared = tuple(EffectSpec(kind=kind) for kind in _FRICTION)
    on_last = (of.robot.joint_names[last],)
    loads = tuple(
        EffectSpec(kind="payload", joints=on_last, runs=(run,)) for run in (WEIGHED, UNKNOWN)
    )
    known = KnownPayloadSpec(
        runs=(WEIGHED,), mass=float(weighed), center=tuple(map(float, centres[0]))
    )
    found = []
    for how in (IdentificationSpec(known_payload=known), IdentificationSpec(gain_std=0.1)):
        spec = of.spec.model_copy(update={"effects": (*declared, *loads), "identification": how})
        found.append(identify(of.robot, of.base, data, spec))
    first, second = (_mass(each) for each in found)
    shown = {e.joints[0]: i for i, e in enumerate(found[0].fit.effects) if e.kind == "torque_gain"}
    told = [found[0].fit.effect_report(shown[j])["gain"] for j in joints]
    return Case(
        name, float(mass),
        first.value / mass - 1.0, (first.value - mass) / first.std,
        second.value / mass - 1.0, (second.value - mass) / second.std,
        tuple((x.value - gain) / x.std for x, gain in zip(told, gains, strict=True)),
    )  # fmt: skip


def friction_of(joints: int, rng: np.random.Generator) -> list[Planted]:
    """Viscous and Coulomb friction of every joint."""
    return [
        plant(kind_named(kind), (j,), float(rng.uniform(0.5, 5.0)))
        for kind in _FRICTION
        for j in range(joints)
    ]


def payload_of(joint: int, mass: float, centre: Array, run: str) -> Planted:
    """A sphere on the joint's link in one run."""
    others = dict(zip(("cx", "cy", "cz"), map(float, centre), strict=True))
    one = plant(kind_named("payload"), (joint,), float(mass), others)
    return replace(one, effect=replace(one.effect, runs=(run,)))


def _mass(found: Identification) -> Value:
    (index,) = (i for i, e in enumerate(found.fit.effects) if e.runs == (UNKNOWN,))
    return found.fit.effect_report(index)["mass"]


def main() -> None:
    """Print a row per case, and the rates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    print(" case robot  mass    known payload      gains assumed")
    cases = []
    for k in range(arguments.cases):
        each = case(ROBOTS[k % 2], arguments.seed * 1000 + k)
        cases.append(each)
        print(
            f"{k:5d} {each.robot:6s} {each.mass:.2f} kg "
            f"{each.known_error:+.2%} (z {each.known_z:+.1f})   "
            f"{each.assumed_error:+.1%} (z {each.assumed_z:+.1f})",
            flush=True,
        )
    known = np.array([each.known_error for each in cases])
    rows = {
        "mass within 1 %, known payload": np.abs(known) <= 0.01,
        "95 % interval holds it, known payload": [abs(e.known_z) <= _INTERVAL for e in cases],
        "95 % interval holds it, gains assumed": [abs(e.assumed_z) <= _INTERVAL for e in cases],
        "95 % interval holds a gain": [abs(z) <= _INTERVAL for e in cases for z in e.gains_z],
    }
    print(f"\nlargest error of the mass with a known payload: {np.abs(known).max():.2%}")
    for words, hits in rows.items():
        print(f"{words:40s} {np.sum(hits)} of {len(hits)} ({np.mean(hits):.1%})")


if __name__ == "__main__":
    main()
