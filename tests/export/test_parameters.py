import numpy as np
import pytest
import yaml

from excite_cli.config.data_spec import EffectSpec, IdentificationSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.export.parameters import effect_specs, parameters_yaml
from excite_cli.identification.fit import fit
from tests.identification.synthetic import measured, regression_of
from tests.robot.random_robots import random_robot


def test_what_was_identified_and_effects_that_a_problem_takes() -> None:
    robot = random_robot(3, joints=3, prismatic=False)
    specs = (
        EffectSpec(kind="viscous_friction", joints=("joint_1", "joint_3")),
        EffectSpec(kind="stribeck_friction", joints=("joint_2",), shape={"stribeck_speed": 0.1}),
        EffectSpec(kind="coupled_friction", joints=("joint_2", "joint_3")),
        EffectSpec(kind="torque_offset", joints=("joint_1",), runs=("r2",)),
    )
    effects = declared_effects(specs, robot)
    data = measured(robot, standard_parameters(robot), noise=0.1, seconds=5.0)
    found = fit(regression_of(robot, data, effects), IdentificationSpec())
    text = parameters_yaml(robot, found)
    tree = yaml.safe_load(text)
    problem = {"robot": {"urdf": "x.urdf"}, "effects": tree["effects"]}
    again = declared_effects(parse_spec(yaml.safe_dump(problem)).effects, robot)
    assert sorted(map(str, again)) == sorted(map(str, effects))
    identified = tree["identified"]
    first = identified["base_parameters"][found.names[0]]
    assert first["value"] == pytest.approx(found.values[0])
    assert first["std"] == pytest.approx(found.std[0])
    viscous = identified["effects"][0]
    assert viscous["kind"] == "viscous_friction"
    assert viscous["parameters"]["viscous"]["unit"] == "N·m·s/rad"
    assert identified["bodies"]["joint_1"]["m"] == pytest.approx(found.best_phi()[0])
    assert list(identified["noise"].values()) == pytest.approx(found.noise)


def test_effects_of_one_kind_share_an_entry() -> None:
    robot = random_robot(3, joints=3, prismatic=False)
    effects = declared_effects((EffectSpec(kind="viscous_friction"),), robot)
    names = np.array(robot.joint_names)
    assert effect_specs(effects, robot.joint_names) == [
        {"kind": "viscous_friction", "joints": list(names)}
    ]
