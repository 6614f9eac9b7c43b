"""A self-test from Python and at the command line: outcomes, messages, what is kept."""

import re
from pathlib import Path

import numpy as np
import pytest

from excite_cli import (
    ConfigError,
    FileError,
    MissingExtraError,
    Result,
    RobotError,
    load_case,
    load_problem,
    plan,
    selftest,
    simulate,
)
from excite_cli.api import outcome_prediction, selftesting
from excite_cli.api.motions import load_motions
from excite_cli.api.outcome_prediction import predicted_outcomes
from excite_cli.api.selftesting import selftest_answer, usual_settings
from excite_cli.errors import ContradictionError
from excite_cli.shown.note import unheard
from excite_cli.simulation.ground_truth import parse_planted
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import _noise
from excite_cli.study.selftest import Outcome

pytestmark = pytest.mark.long

SMOKE = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
EASY, FAINT = "armature@elbow=0.15", "torque_gain@wrist_roll=0.0001"


@pytest.fixture(scope="module")
def result() -> Result:
    return plan(load_problem(SMOKE, ["optimizer.max_iterations=20", "constraints={}"]))


def test_what_is_found_and_what_is_not(result: Result) -> None:
    case = load_case(SMOKE)
    told: list[int] = []
    found = selftest(case, result, [EASY, FAINT], progress=lambda news: told.append(news.done))
    easy, faint = found.cases
    assert easy.outcome == Outcome.FOUND
    assert easy.found == pytest.approx(0.15, abs=4 * easy.std)
    assert easy.after < easy.before
    assert easy.power > 0.9
    assert faint.outcome == Outcome.NOT_FOUND
    assert faint.power < 0.1
    assert [each.predicted for each in found.cases] == ["found", "not found"]
    assert np.isnan(faint.found)
    assert found.good
    assert told[-1] == 2
    answer = selftest_answer(found)
    assert answer.parts[0].startswith("1 of 2 planted effects would be found (1 not found)")  # type: ignore[union-attr]
    assert [each["outcome"] for each in answer.data["cases"]] == ["found", "not found"]


def test_a_zero_that_lies_elsewhere_is_an_encoder_offset(result: Result) -> None:
    found = selftest(load_case(SMOKE), result, ["encoder_offset@elbow=0.15"])
    assert found.cases[0].outcome == found.cases[0].predicted == Outcome.FOUND
    assert found.cases[0].named == "encoder_offset@elbow"


@pytest.mark.parametrize(("joint", "outcome"), [("elbow", "found"), ("slide", "failed")])
def test_a_refusal_that_names_the_zero_is_an_answer(
    result: Result, monkeypatch: pytest.MonkeyPatch, joint: str, outcome: str
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise ContradictionError("the measured data contradict the robot", [("zero", (joint,))])

    monkeypatch.setattr(selftesting, "diagnose", refuse)
    asked = ["encoder_offset@elbow=0.15"]
    if outcome == "found":
        assert selftest(load_case(SMOKE), result, asked).cases[0].outcome == Outcome.FOUND
    else:
        with pytest.raises(FileError, match="every case failed: the measured data contradict"):
            selftest(load_case(SMOKE), result, asked)


@pytest.mark.parametrize(("correlation", "rate"), [(0.0, 500.0), (0.9, 500.0), (-0.3, 40.0)])
def test_the_noise_of_means_is_that_of_drawn_means(correlation: float, rate: float) -> None:
    settings = SimulationSettings(rate=rate, torque_noise=0.05, noise_correlation=correlation)
    size = round(rate / 20.0)
    drawn = _noise((200_000, 1), correlation, np.random.default_rng(1))
    means = drawn[: len(drawn) // size * size].reshape(-1, size).mean(axis=1)
    assert outcome_prediction._noise_of_means(settings, 20.0) == pytest.approx(
        0.05 * means.std(), rel=0.03
    )


def test_more_noise_is_less_power(result: Result) -> None:
    case, effect = load_case(SMOKE), "torque_gain@elbow=0.02"
    powers = []
    for noise, correlation, rate in ((0.01, 0.0, 500.0), (0.1, 0.0, 500.0), (0.1, 0.9, 500.0)):
        settings = SimulationSettings(1, rate, noise, correlation)
        (one,) = parse_planted(effect, case.robot, {})
        motions = load_motions(case, result, (), unheard)
        (found,) = predicted_outcomes(case, motions, [one], settings, unheard)
        assert found is not None
        powers.append(found.named)
    assert powers[0] > 0.9 > powers[1] > powers[2]
    assert powers[2] < 0.2


def test_a_folder_keeps_what_is_done(result: Result, tmp_path: Path) -> None:
    case, folder = load_case(SMOKE), tmp_path / "tested"
    asked = iter([False, True])
    effects = [EASY, FAINT]
    first = selftest(case, result, effects, output=folder, ended=lambda: next(asked))
    (folder / "selftest.html").unlink()
    with pytest.raises(FileError, match="exists already"):
        selftest(case, result, effects, output=folder)
    other = SimulationSettings(seed=5)
    with pytest.raises(FileError, match="made with another config"):
        selftest(case, result, effects, other, output=folder, resume=True)
    with pytest.raises(ConfigError, match="give one of them, with -o FOLDER"):
        selftest(case, result, effects, resume=True)
    told: list[int] = []
    both = selftest(
        case, result, effects, output=folder, resume=True, progress=lambda it: told.append(it.done)
    )
    assert both.cases[0] == first.cases[0]  # with its seconds: it was not done again
    assert told[0] == 1
    assert [each.effect for each in both.cases] == effects
    assert "Predicted and seen" in (folder / "selftest.html").read_text()


def test_stopping_keeps_what_is_done(result: Result) -> None:
    asked = iter([False, True])
    found = selftest(load_case(SMOKE), result, [EASY, FAINT], ended=lambda: next(asked))
    assert [each.effect for each in found.cases] == [EASY]
    assert "1 not tried" in str(selftest_answer(found).parts[0])


def test_measured_motions_are_replayed_at_their_rate(result: Result) -> None:
    case = load_case(SMOKE)
    log = simulate(case, result, (), SimulationSettings(rate=200.0)).dataset
    assert usual_settings(case, log).rate == pytest.approx(200.0)
    assert usual_settings(case, result).rate == SimulationSettings().rate


@pytest.mark.parametrize(
    ("effect", "overrides", "words"),
    [
        ("sprong@elbow=1", [], "sprong.*Did you mean 'spring'"),
        ("spring@elbo=1", [], "no moved joint 'elbo'"),
        ("spring@elbow", [], "not of the form"),
        ("spring@elbow=1", ["effects=[{kind: spring, joints: [elbow]}]"], "config declares it"),
        (EASY, ["measurement.covariates=[temp]"], "no further columns"),
        (f"{EASY}|{EASY}", [], "given twice"),
    ],
)
def test_messages(result: Result, effect: str, overrides: list[str], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        selftest(load_case(SMOKE, overrides), result, effect.split("|"))


def test_motions_of_another_robot(result: Result) -> None:
    with pytest.raises(FileError, match="moves other joints"):
        selftest(load_case(SMOKE, ["robot.joints=[elbow, slide]"]), result)


def test_a_robot_without_masses(result: Result, tmp_path: Path) -> None:
    urdf = (SMOKE.parents[1] / "data" / "smoke_arm.urdf").read_text()
    (tmp_path / "arm.urdf").write_text(re.sub(r"<inertial>.*?</inertial>", "", urdf, flags=re.S))
    with pytest.raises(RobotError, match="no masses"):
        selftest(load_case(SMOKE, [f"robot.urdf={tmp_path / 'arm.urdf'}"]), result, [EASY])


def test_without_mujoco(result: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise MissingExtraError("pip install 'excite-cli[sim]'")

    monkeypatch.setattr(selftesting, "load_mujoco", missing)
    with pytest.raises(MissingExtraError, match="sim"):
        selftest(load_case(SMOKE), result)
