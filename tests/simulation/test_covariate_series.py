"""Further columns of a simulated log: their courses, and the words that ask for them."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.errors import ConfigError
from excite_cli.robot.model import Robot
from excite_cli.simulation.build import assemble
from excite_cli.simulation.covariate_series import CovariateSeries, parse_series
from excite_cli.simulation.ground_truth import parse_planted
from tests.simulation.arms import arm


@pytest.fixture(scope="module")
def robot() -> Robot:
    return arm()


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
