"""The words that plant effects, and what is said when they are wrong."""

import re
import shlex
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.errors import ConfigError
from excite_cli.robot.model import Robot
from excite_cli.simulation.ground_truth import parse_planted
from tests.simulation.arms import arm

RUNS = {"motion_1": ("motion_1_take_1", "motion_1_take_2"), "motion_2": ("motion_2",)}


@pytest.fixture(scope="module")
def robot() -> Robot:
    return arm()


def test_a_local_kind_gives_one_effect_for_each_joint(robot: Robot) -> None:
    both = parse_planted("coulomb_friction@elbow_joint, wrist_1_joint = 4", robot, RUNS)
    assert [p.effect.joints for p in both] == [(2,), (3,)]
    assert [p.values.tolist() for p in both] == [[4.0], [4.0]]
    assert len(parse_planted("viscous_friction@all=1", robot, RUNS)) == robot.n


def test_pairs_and_robots_are_one(robot: Robot) -> None:
    (pair,) = parse_planted("coupled_friction@wrist_1_joint,wrist_2_joint=1", robot, RUNS)
    assert pair.effect.joints == (3, 4)
    (tilt,) = parse_planted("base_tilt@all=0.03,pitch:0.01", robot, RUNS)
    assert tilt.effect.joints == tuple(range(6))
    assert tilt.values.tolist() == [0.03, 0.01]


def test_named_numbers_runs_and_takes(robot: Robot) -> None:
    (friction,) = parse_planted(
        "stribeck_friction@elbow_joint=3,stribeck_speed:0.05;runs:motion_1", robot, RUNS
    )
    assert friction.effect.shape == {"stribeck_speed": 0.05}
    assert friction.effect.runs == ("motion_1_take_1", "motion_1_take_2")
    (load,) = parse_planted("payload@all=1.5;runs:motion_2|motion_1_take_2", robot, RUNS)
    assert set(load.effect.runs) == {"motion_2", "motion_1_take_2"}


def test_other_words_of_a_kind_are_understood(robot: Robot) -> None:
    (spring,) = parse_planted("spring@elbow_joint=20,rest_position:0.5", robot, RUNS)
    assert spring.values == pytest.approx(np.array([20.0, -10.0]))
    (load,) = parse_planted("payload@all=2,cz:0.1", robot, RUNS)
    assert load.values[3] == pytest.approx(0.2)


def test_levels_and_gaps_are_what_is_given_first(robot: Robot) -> None:
    (saturation,) = parse_planted("torque_saturation@elbow_joint=30,actuator:1", robot, RUNS)
    assert saturation.effect.shape == {"level": 30.0}
    assert saturation.values.tolist() == [1.0]
    assert saturation.extra == {"actuator": 1.0}
    (play,) = parse_planted("backlash@elbow_joint=0.01", robot, RUNS)
    assert play.effect.shape == {"gap": 0.01}


def test_a_record_says_everything_by_name(robot: Robot) -> None:
    (spring,) = parse_planted("spring@elbow_joint=20,rest_position:0.5;runs:motion_2", robot, RUNS)
    record = spring.record(robot.joint_names, robot.sliding)
    assert record["kind"] == "spring"
    assert record["joints"] == ["elbow_joint"]
    assert record["runs"] == ["motion_2"]
    parameters = record["parameters"]
    assert isinstance(parameters, dict)
    assert parameters["stiffness"] == {"value": 20.0, "unit": "N·m/rad"}
    slides = spring.record(robot.joint_names, np.ones(robot.n, dtype=bool))["parameters"]
    assert [each["unit"] for each in slides.values()] == ["N/m", "N", "m"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("coulomb_friction", "not of the form kind@joint"),
        ("coulomb_friction@=3", "not of the form kind@joint"),
        ("coulom_friction@elbow_joint=4", "no effect 'coulom_friction'. Did you mean 'coulomb"),
        ("coulomb_friction@elbow=4", "no moved joint 'elbow'. Did you mean 'elbow_joint'?"),
        ("coulomb_friction@elbow_joint=many", "'many' is not a finite number"),
        ("coulomb_friction@elbow_joint=inf", "'inf' is not a finite number"),
        ("coulomb_friction@elbow_joint=4,speed:1", "has no parameter 'speed'"),
        ("stribeck_friction@elbow_joint=4,stribek_speed:1", "Did you mean 'stribeck_speed'?"),
        ("stribeck_friction@elbow_joint=4,0.1", "'0.1' is not name:value"),
        ("coupled_friction@elbow_joint=4", "acts on two joints; name exactly two"),
        ("payload@all=1;runs:motion_3", "no run 'motion_3'"),
        ("payload@all=1;motion_2", "only 'runs:name|name' and 'covariate:column'"),
    ],
)
def test_messages(robot: Robot, text: str, words: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(words)) as error:
        parse_planted(text, robot, RUNS)
    assert text in str(error.value)


def test_an_example_is_quoted_for_a_shell(robot: Robot) -> None:
    odd = replace(robot, joint_names=(*robot.joint_names[:-1], "tool's joint"))
    with pytest.raises(ConfigError) as error:
        parse_planted("spring", odd, RUNS)
    example = str(error.value).partition("for example ")[2].removesuffix(".")
    assert shlex.split(example) == ["coulomb_friction@tool's joint=4"]
