"""BAM's parameters: names and models M1 to M4, as its loader knows them."""

import json
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.export.bam import bam, holds
from excite_cli.export.drive import Drive
from excite_cli.export.joint_values import joint_values
from tests.export.drives import drive, identified, ur10
from tests.robot.random_robots import random_robot

# What `Model.load_parameters_from_dict` of BAM looks for, by model; beside the actuator's own.
OF_ALL = {"q_offset", "command_delay", "friction_base", "friction_viscous"}
STRIBECK = {"friction_stribeck", "dtheta_stribeck", "alpha"}
OF_MODEL = {
    "m1": OF_ALL,
    "m2": OF_ALL | STRIBECK,
    "m3": OF_ALL | {"load_friction_base"},
    "m4": OF_ALL | STRIBECK | {"load_friction_base", "load_friction_stribeck"},
}
OF_ACTUATOR = {"ratio", "max_torque", "armature"}
BESIDE = {"model", "actuator", "kp", "damping"}
ELBOW = ("elbow_joint",)


def exported(*kinds: str) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Of the elbow, and the notes."""
    robot = ur10()
    specs = [
        EffectSpec(
            kind=kind, joints=ELBOW, shape={"stribeck_speed": 0.2} if "strib" in kind else {}
        )
        for kind in kinds
    ]
    model = identified(robot, *specs)
    text = bam(robot, model, joint_values(robot, model, drive(0.01)))
    tree = json.loads(text.text)
    assert list(tree) == list(robot.joint_names)
    return tree["elbow_joint"], text.notes


@pytest.mark.parametrize(
    ("more", "model"),
    [
        ((), "m1"),
        (("stribeck_friction",), "m2"),
        (("load_dependent_friction",), "m3"),
        (("stribeck_friction", "load_dependent_friction"), "m4"),
    ],
)
def test_the_model_is_the_least_that_has_the_friction(more: tuple[str, ...], model: str) -> None:
    found, notes = exported("armature", "viscous_friction", "coulomb_friction", *more)
    assert found["model"] == model
    assert set(found) == OF_MODEL[model] | OF_ACTUATOR | BESIDE
    assert (found["friction_viscous"], found["friction_base"]) == (0.1, 0.1)
    assert (found["kp"], found["damping"], found["max_torque"]) == (150.0, 5.0, 100.0)
    assert (found["armature"], found["command_delay"]) == (0.1, 0.01)
    if "load_dependent_friction" in more:
        assert found["load_friction_base"] == 0.05, "BAM's gear carries motor and load"
    if "stribeck_friction" in more:
        assert (found["dtheta_stribeck"], found["alpha"]) == (0.2, 2.0)
    assert notes == ("one set for each joint: bam.model.load_model_from_dict(data[joint])",)


def test_one_joint_is_one_file_of_bam_and_what_it_cannot_hold_is_reported() -> None:
    robot = random_robot(1, joints=1, prismatic=False)
    model = identified(robot, EffectSpec(kind="coulomb_friction"), EffectSpec(kind="ripple"))
    one = Drive(np.ones(1), np.zeros(1), np.full(1, np.inf), np.zeros(1))
    text = bam(robot, model, joint_values(robot, model, one))
    found = json.loads(text.text)
    assert found["model"] == "m1"
    assert np.isfinite(found["max_torque"])
    assert text.notes == (f"BAM cannot hold: ripple at {robot.joint_names[0]}",)
    assert not holds(model.effects[1], np.ones(2))
    assert holds(model.effects[0], np.ones(1))
    assert not holds(model.effects[0], -np.ones(1))
