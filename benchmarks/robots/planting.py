"""An effect for a robot that was just planned for: kind, place and size follow from a seed.

Run in a process of its own by the journey, since it loads the robot:
python -m benchmarks.robots.planting CONFIG MOTIONS SEED, which prints one line of JSON.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.battery.cases import (
    Arm,
    ground_and_model,
    kinds,
    left_over,
    one_effect,
    plant_of,
)
from benchmarks.battery.sizes import Sized
from excite_cli.api.loading import load_case
from excite_cli.api.motions import load_motions
from excite_cli.dynamics.base_parameters import base_parameters_as_given
from excite_cli.effects.catalogue import catalogue, declared_effects, kind_named
from excite_cli.robot.model import Robot
from excite_cli.simulation.ground_truth import PlantedEffect, allowed_names, parse_planted
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings

_SHOWS = 1e-3  # share of its energy that the declared model must leave, as in the battery


def drawn(config: Path, motions: Path, seed: int) -> dict[str, Any]:
    """Words for `excite simulate --effect`, and what a diagnosis should name.

    Kinds are tried in an order that the seed gives, at places in random order, until one has a
    sensible size that the declared model does not absorb.
    """
    case = load_case(config, ())
    robot = case.robot
    planned = [
        PlannedMotion(each.name, each.trajectory, each.coefficients)
        for each in load_motions(case, motions)
    ]
    declared = declared_effects(case.spec.effects, robot)
    of = Arm(robot.name, robot, base_parameters_as_given(robot), case.spec)
    ground, model = ground_and_model(of, planned, SimulationSettings(seed=seed), case.spec.effects)
    rng = np.random.default_rng(seed)
    for name in rng.permutation(kinds()):
        found = one_effect(kind_named(str(name)), of, ground, model, (_SHOWS, np.inf), rng)
        if found is not None:
            plain = {(each.kind, joint) for each in declared for joint in each.joints}
            wanted = {
                (kind, joint)
                for kind in ("viscous_friction", "coulomb_friction")
                for joint in range(robot.n)
            }
            takes = {run: (run,) for run in ground.runs}
            # Its RMS that the declared model cannot take up, over that of the joint's torque.
            shown = found.ratio * float(np.sqrt(left_over(model, found, ground)))
            return _record(found, robot, takes) | {"friction": wanted <= plain, "shown": shown}
    raise RuntimeError("no effect shows on these motions")


def _record(found: Sized, robot: Robot, takes: dict[str, tuple[str, ...]]) -> dict[str, Any]:
    plant = plant_of(found, robot)
    every = (found.planted, *found.companions)
    return {
        "effects": [words(each, robot, takes) for each in every],
        "kind": plant.name.kind,
        "joints": list(plant.name.joints),
        "touched": list(plant.touched),
        "companions": [[name.kind, list(name.joints)] for name in plant.companions],
        "moved": robot.n,
        "ratio": found.ratio,
    }


def words(planted: PlantedEffect, robot: Robot, takes: dict[str, tuple[str, ...]]) -> str:
    """As `--effect` takes it.

    Raises
    ------
    ValueError
        Read again it would be another effect.
    """
    effect, kind = planted.effect, catalogue()[planted.effect.kind]
    numbers = planted.named()
    first = kind.known_by or kind.parameters[0].name
    others = [f"{name}:{numbers[name]!r}" for name in allowed_names(kind) if name in numbers]
    joints = (
        "all"
        if effect.joints == tuple(range(robot.n))
        else ",".join(robot.joint_names[joint] for joint in effect.joints)
    )
    runs = f";runs:{'|'.join(effect.runs)}" if effect.runs else ""
    text = f"{kind.kind}@{joints}={','.join([repr(numbers[first]), *others])}{runs}"
    again = parse_planted(text, robot, takes)
    same = len(again) == 1 and again[0].effect == effect
    if not same or not np.allclose(again[0].values, planted.values):
        raise ValueError(f"{text} is not what was drawn")
    return text


if __name__ == "__main__":
    print(json.dumps(drawn(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))))
