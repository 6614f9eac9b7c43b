"""What people and scripts see of a diagnosis: names apart from approximations."""

from dataclasses import replace
from io import StringIO

import pytest
from excite_cli.cli.diagnose_tables import answer_of, tables_of
from rich.console import Console

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.robot.model import build_robot
from tests.diagnosis.synthetic_diagnosis import CONFIG, make_diagnosis, smoke_spec

NEXT = {"purpose": "excite", "command": "excite optimize", "pairs": []}
REASON = "a function of v[elbow]"


@pytest.fixture(scope="module")
def doubted() -> Diagnosis:
    """The one effect that was found is only an approximation."""
    found = make_diagnosis(rivals=())
    first = replace(found.effects[0], approximates=REASON)
    processing = {
        "samples": 10, "rate": 20.0, "position_cutoff": 8.0, "candidates": 3, "inflation": 1.0,
    }  # fmt: skip
    return replace(found, effects=(first, *found.effects[1:]), processing=processing)


def test_an_approximation_is_no_name_for_scripts(doubted: Diagnosis) -> None:
    answer = answer_of(doubted, NEXT)
    assert answer["effects"] == []
    (told,) = answer["approximations"]
    assert (told["kind"], told["stands_for"]) == ("viscous_friction", REASON)


def test_an_approximation_has_a_table_of_its_own(doubted: Diagnosis) -> None:
    text = printed(doubted)
    assert "Approximations: they lower the error, but something else is there" in text
    assert REASON in text
    assert "What the declared model lacks" not in text
    assert "0 effects, 1 approximation" in text


def printed(found: Diagnosis) -> str:
    robot = build_robot(smoke_spec().robot, CONFIG.parent)
    console = Console(width=200, record=True, file=StringIO(), markup=False)
    for part in tables_of(found, robot, NEXT, verbose=False):
        console.print(part)
    return console.export_text()


def test_the_noise_floor_stands_beside_the_errors(doubted: Diagnosis) -> None:
    """All joints are left with 1 N·m; repeated periods show 0.8 N·m, at the elbow 0.25 N·m."""
    floor = {name: 0.25 if name == "elbow" else 0.8 for name in doubted.joint_names[:-1]}
    found = replace(doubted, noise_floor=floor)
    text = printed(found)
    assert "noise floor" in text
    assert "1.2 times the noise that repeated periods show (elbow 4.0 times)" in text
    rows = text.partition("Error of the torque")[2].splitlines()
    unknown = next(line for line in rows if line.startswith(doubted.joint_names[-1]))
    assert unknown.split()[-1] == "-"
    assert answer_of(found, NEXT)["noise_floor"] == floor


def test_without_repeated_periods_nothing_is_said_of_noise(doubted: Diagnosis) -> None:
    assert "noise" not in printed(doubted)
    assert answer_of(doubted, NEXT)["noise_floor"] is None
