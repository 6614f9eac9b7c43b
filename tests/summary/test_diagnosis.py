"""What people and scripts see of a diagnosis: names apart from approximations."""

from dataclasses import replace

import pytest

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Approximation, Diagnosis
from excite_cli.shown.table import Table
from excite_cli.summary.diagnosis import diagnosis_answer
from tests.diagnosis.synthetic_diagnosis import make_diagnosis

REASON = "a function of v[elbow]"


@pytest.fixture(scope="module")
def doubted() -> Diagnosis:
    """The one effect that was found is only an approximation."""
    found = make_diagnosis(rivals=())
    first = replace(found.effects[0], approximates=Approximation((Covariate("speed", "elbow"),)))
    processing = {
        "samples": 10, "rate": 20.0, "position_cutoff": 8.0, "candidates": 3, "inflation": 1.0,
    }  # fmt: skip
    return replace(found, effects=(first, *found.effects[1:]), processing=processing)


def test_an_approximation_is_no_name_for_scripts(doubted: Diagnosis) -> None:
    answer = diagnosis_answer(doubted, "arm.yaml", {}).data
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
    """Titles, columns and cells, a line each row, without a terminal."""
    lines: list[str] = []
    for part in diagnosis_answer(found, "arm.yaml", {}).parts:
        if isinstance(part, Table):
            lines += [part.title, " ".join(part.columns), *(" ".join(row) for row in part.rows)]
        else:
            lines.append(part)
    return "\n".join(lines)


def test_other_names_of_the_same_torque_are_told() -> None:
    found = make_diagnosis(rivals=())
    (named, *others) = found.effects
    effect = replace(named.effect, kind="asymmetric_friction")
    text = printed(replace(found, effects=(replace(named, effect=effect), *others)))
    assert "is the same torque as coulomb_friction and torque_offset" in text
    assert "the same torque" not in printed(found)


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
    assert diagnosis_answer(found, "arm.yaml", {}).data["noise_floor"] == floor


def test_without_repeated_periods_nothing_is_said_of_noise(doubted: Diagnosis) -> None:
    assert "noise" not in printed(replace(doubted, large_rests=()))


def test_nothing_is_missing_only_where_nothing_large_is_left(doubted: Diagnosis) -> None:
    (rest,) = doubted.large_rests
    bare = replace(doubted, effects=(), unexplained=(), large_rests=())
    assert "Nothing is missing" in printed(bare)
    for left, whole in ((rest, False), (replace(rest, certain=False), True)):
        text = printed(replace(bare, large_rests=(left,)))
        assert ("Nothing is missing" in text) == whole
        assert "0.8" in text
        assert "elbow" in text
    assert "q[elbow] and load[elbow]" in printed(replace(bare, large_rests=(rest,)))
    alone = replace(rest, depends_on=(), predictable=0.0, certain=False, noise=None)
    assert "the noise is not known" in printed(replace(bare, large_rests=(alone,)))
    assert "memory could be as large" in printed(
        replace(bare, large_rests=(replace(alone, noise=0.1),))
    )
    assert diagnosis_answer(doubted, "arm.yaml", {}).data["noise_floor"] is None
