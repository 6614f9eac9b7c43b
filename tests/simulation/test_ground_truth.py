"""The words that plant effects and ask for further columns, and what is said of wrong ones."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.errors import ConfigError
from excite_cli.robot.model import Robot
from excite_cli.simulation.build import assemble
from excite_cli.simulation.covariate_series import CovariateSeries, parse_series
from excite_cli.simulation.ground_truth import parse_planted

RUNS = {"motion_1": ("motion_1_take_1", "motion_1_take_2"), "motion_2": ("motion_2",)}


def test_a_local_kind_gives_one_effect_for_each_joint(robot: Robot) -> None:
    """Of pairs and robots there is one."""
    both = parse_planted("coulomb_friction@elbow_joint, wrist_1_joint = 4", robot, RUNS)
    assert [p.effect.joints for p in both] == [(2,), (3,)]
    assert [p.values.tolist() for p in both] == [[4.0], [4.0]]
    assert len(parse_planted("viscous_friction@all=1", robot, RUNS)) == robot.n
    (pair,) = parse_planted("coupled_friction@wrist_1_joint,wrist_2_joint=1", robot, RUNS)
    assert pair.effect.joints == (3, 4)
    (tilt,) = parse_planted("base_tilt@all=0.03,pitch:0.01", robot, RUNS)
    assert tilt.effect.joints == tuple(range(6))
    assert tilt.values.tolist() == [0.03, 0.01]


@pytest.mark.parametrize(
    ("text", "values", "shape"),
    [
        ("spring@elbow_joint=20,rest_position:0.5", [20.0, -10.0], {}),
        ("payload@all=2,cz:0.1", [2.0, 0.0, 0.0, 0.2], {}),
        # Levels and gaps are what is given first.
        ("torque_saturation@elbow_joint=30,actuator:1", [1.0], {"level": 30.0}),
        ("backlash@elbow_joint=0.01", [1.0], {"gap": 0.01}),
    ],
)
def test_other_words_of_a_kind_are_understood(
    robot: Robot, text: str, values: list[float], shape: dict[str, float]
) -> None:
    (found,) = parse_planted(text, robot, RUNS)
    assert found.values[: len(values)] == pytest.approx(values)
    assert found.effect.shape == shape
    assert found.extra == ({"actuator": 1.0} if "actuator" in text else {})


def test_named_numbers_runs_and_takes(robot: Robot) -> None:
    (friction,) = parse_planted(
        "stribeck_friction@elbow_joint=3,stribeck_speed:0.05;runs:motion_1", robot, RUNS
    )
    assert friction.effect.shape == {"stribeck_speed": 0.05, "load_power": 0.0}
    assert friction.effect.runs == ("motion_1_take_1", "motion_1_take_2")
    (load,) = parse_planted("payload@all=1.5;runs:motion_2|motion_1_take_2", robot, RUNS)
    assert set(load.effect.runs) == {"motion_2", "motion_1_take_2"}


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


def test_a_column_warms_up_over_the_campaign() -> None:
    (series,) = parse_series(["temp=25,end:45,time_constant:600,noise:0.5"])
    clock = np.array([0.0, 600.0, 1e5])
    expected = [25.0, 45.0 - 20.0 / np.e, 45.0]
    assert series.at(clock) == pytest.approx(expected, abs=2e-3)
    noise = series.recorded(np.full(4000, 600.0), np.random.default_rng(0)) - expected[1]
    assert noise.std() == pytest.approx(0.5, rel=0.05)


def test_a_column_follows_a_table(tmp_path: Path) -> None:
    path = tmp_path / "day.csv"
    path.write_text("t,temp\n0,20\n100,30\n300,10\n", encoding="utf-8")
    (series,) = parse_series([f"temp={path}"])
    assert series.at(np.array([50.0, 200.0, 900.0])) == pytest.approx([25.0, 20.0, 10.0])
    with pytest.raises(ConfigError, match="no column 'ambient'"):
        parse_series([f"ambient={path}"])


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["temp"], "not of the form"),
        (["temp=warm"], "'warm' is not a finite number"),
        (["temp=25,ende:45"], "'ende:45' is not one of end"),
        (["temp=25,time_constant:0"], "time_constant must be positive"),
        (["temp=25", "temp=26"], "'temp' is given twice"),
        (["temp=missing.csv"], "there is no file missing.csv"),
    ],
)
def test_what_cannot_be_is_refused(texts: list[str], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        parse_series(texts)


def test_an_effect_names_the_column_that_it_follows(robot: Robot) -> None:
    text = "covariate_friction@elbow_joint=-0.1,viscous_slope:-0.02,reference:25;covariate:temp"
    (planted,) = parse_planted(text, robot, {})
    assert planted.effect.covariate == "temp"
    assert planted.effect.shape == {"reference": 25.0, "curvature": 0.0}
    assert planted.values.tolist() == [-0.1, -0.02]
    assert planted.record(robot.joint_names, robot.sliding)["covariate"] == "temp"
    with pytest.raises(ConfigError, match="covariate_friction follows a column"):
        parse_planted("covariate_friction@elbow_joint=1", robot, {})
    with pytest.raises(ConfigError, match="spring follows no column"):
        parse_planted("spring@elbow_joint=1;covariate:temp", robot, {})


def test_the_robot_sees_the_column_at_the_time_of_the_campaign(robot: Robot) -> None:
    series = CovariateSeries("temp", (0.0, 100.0), (20.0, 30.0))
    build = assemble(robot, np.zeros(10 * (robot.n + 1)), "run", (), 50.0, (series,))
    assert build.covariates(np.array([0.0, 10.0]))["temp"] == pytest.approx([25.0, 26.0])
