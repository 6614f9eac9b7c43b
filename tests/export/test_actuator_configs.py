"""The modules for Isaac Lab and mjlab, run against classes with the fields that theirs have."""

import json
import sys
from dataclasses import make_dataclass
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.export.actuator_configs import (
    JointValues,
    bam,
    holds,
    isaaclab,
    joint_values,
    mjlab,
)
from excite_cli.export.drive import Drive
from tests.export.drives import KD, KP, LIMIT, drive, identified, ur10
from tests.robot.random_robots import random_robot

# Fields of isaaclab.actuators 2.3 (actuator_base_cfg.py, actuator_pd_cfg.py) and of
# mjlab.actuator 1.6 (actuator.py, builtin_actuator.py).
ISAACLAB = (
    "joint_names_expr", "effort_limit", "velocity_limit", "effort_limit_sim", "velocity_limit_sim",
    "stiffness", "damping", "armature", "friction", "dynamic_friction", "viscous_friction",
)  # fmt: skip
MJLAB = (
    "target_names_expr", "transmission_type", "armature", "frictionloss", "viscous_damping",
    "stiffness", "damping", "effort_limit", "delay_min_lag", "delay_max_lag",
)  # fmt: skip


def stub(name: str, *classes: type) -> ModuleType:
    module = ModuleType(name)
    for each in classes:
        setattr(module, each.__name__, each)
    return module


def run(text: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    def fields(names: tuple[str, ...]) -> list[tuple[str, type, Any]]:
        return [(name, object, None) for name in names]  # type: ignore[misc]

    delays = ("min_delay", "max_delay")
    classes = (
        make_dataclass("ImplicitActuatorCfg", fields(ISAACLAB)),
        make_dataclass("DelayedPDActuatorCfg", fields((*ISAACLAB, *delays))),
    )
    monkeypatch.setitem(sys.modules, "isaaclab", stub("isaaclab"))
    monkeypatch.setitem(sys.modules, "isaaclab.actuators", stub("isaaclab.actuators", *classes))
    built_in = make_dataclass("BuiltinPositionActuatorCfg", fields(MJLAB), kw_only=True)
    monkeypatch.setitem(sys.modules, "mjlab", stub("mjlab"))
    monkeypatch.setitem(sys.modules, "mjlab.actuator", stub("mjlab.actuator", built_in))
    scope: dict[str, Any] = {}
    exec(compile(text, "actuators.py", "exec"), scope)
    return scope["ACTUATORS"]


def values(delay: float) -> JointValues:
    robot = ur10()
    kinds = ("armature", "viscous_friction", "coulomb_friction")
    specs = [EffectSpec(kind=kind, joints=("elbow_joint",)) for kind in kinds]
    return joint_values(robot, identified(robot, *specs, numbers=(0.1, 0.2, 0.3)), drive(delay))


def test_isaac_lab_with_a_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    exported = isaaclab("ur10", values(0.012))
    drives = run(exported.text, monkeypatch)["drives"]
    assert type(drives).__name__ == "DelayedPDActuatorCfg"
    assert (drives.min_delay, drives.max_delay) == (2, 3), "0.012 s in steps of 0.005 s"
    assert drives.joint_names_expr == list(ur10().joint_names)
    assert drives.stiffness == dict(zip(ur10().joint_names, KP, strict=True))
    assert drives.damping["elbow_joint"] == KD[2]
    assert drives.armature["elbow_joint"] == 0.1
    assert drives.viscous_friction["elbow_joint"] == 0.2
    assert drives.friction["elbow_joint"] == pytest.approx(0.3)
    assert drives.dynamic_friction == drives.friction
    assert "wrist_1_joint" not in drives.effort_limit
    assert drives.effort_limit["shoulder_pan_joint"] == LIMIT[0]
    assert not exported.notes


def test_isaac_lab_without_a_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    drives = run(isaaclab("ur10", values(0.0)).text, monkeypatch)["drives"]
    assert type(drives).__name__ == "ImplicitActuatorCfg"
    assert drives.effort_limit_sim["wrist_3_joint"] == LIMIT[5]
    assert drives.effort_limit is None


@pytest.mark.parametrize("delay", [0.0, 0.01])
def test_mjlab(delay: float, monkeypatch: pytest.MonkeyPatch) -> None:
    actuators = run(mjlab("ur10", values(delay)).text, monkeypatch)
    assert [each.target_names_expr for each in actuators] == [(n,) for n in ur10().joint_names]
    elbow = actuators[2]
    assert (elbow.stiffness, elbow.damping, elbow.effort_limit) == (150.0, 5.0, 100.0)
    assert (elbow.armature, elbow.viscous_damping, elbow.frictionloss) == (0.1, 0.2, 0.3)
    assert actuators[3].effort_limit is None
    lags = elbow.delay_min_lag, elbow.delay_max_lag
    assert lags == ((2, 2) if delay else (None, None))


def test_names_are_no_patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    odd = JointValues(("a.b", *ur10().joint_names[1:]), drive(), *np.zeros((3, 6)))
    assert run(mjlab('"odd" \\', odd).text, monkeypatch)[0].target_names_expr == (r"a\.b",)
    drives = run(isaaclab("odd", odd).text, monkeypatch)["drives"]
    assert r"a\.b" in drives.stiffness
    assert drives.joint_names_expr[0] == r"a\.b"


def test_what_is_not_in_them_is_reported() -> None:
    spring = EffectSpec(kind="spring", joints=("elbow_joint",))
    robot = ur10()
    model = identified(
        robot,
        spring,
        EffectSpec(kind="torque_offset", joints=("elbow_joint",)),
        EffectSpec(kind="ripple", joints=("elbow_joint",)),
    )
    told = " | ".join(joint_values(robot, model, drive()).notes)
    assert "not in it: ripple at elbow_joint. The file of parameters" in told
    assert "springref, stiffness of elbow_joint. --format mjcf has it" in told
    assert "offsets of the drives' torque at elbow_joint" in told


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


def test_a_peak_that_grows_with_the_load_is_bams_own() -> None:
    robot = random_robot(1, joints=1, prismatic=False)
    shape = {"stribeck_speed": 0.2, "load_power": 1.0}
    model = identified(robot, EffectSpec(kind="stribeck_friction", shape=shape))
    one = Drive(np.ones(1), np.zeros(1), np.full(1, np.inf), np.zeros(1))
    found = json.loads(bam(robot, model, joint_values(robot, model, one)).text)
    assert (found["model"], found["friction_stribeck"], found["load_friction_base"]) == ("m4", 0, 0)
    assert found["load_friction_stribeck"] == pytest.approx(0.05)


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
