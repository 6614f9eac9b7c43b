"""A diagnosis that does not lower the held-out error is not built upon unasked."""

from dataclasses import replace
from pathlib import Path

import pytest

from excite_cli import Case, ConfigError, plan_after, save_config
from excite_cli.diagnosis.answer_words import answer_in_words
from excite_cli.diagnosis.records import Diagnosis, Textbook
from excite_cli.diagnosis.words import no_gain_in_words
from excite_cli.export.parameters import found_config
from excite_cli.robot.model import build_robot
from excite_cli.shown.note import Level, Note
from excite_cli.summary.diagnosis import diagnosis_data
from tests.diagnosis.synthetic_diagnosis import CONFIG, make_diagnosis, smoke_spec

TOLD = "The held-out error did not fall: 10.00% before, 10.00% after"


@pytest.fixture(scope="module")
def bad() -> Diagnosis:
    found = make_diagnosis(rivals=())
    return replace(found, before=found.after)


@pytest.fixture(scope="module")
def case() -> Case:
    spec = smoke_spec()
    return Case(spec, CONFIG.parent, build_robot(spec.robot, CONFIG.parent))


def test_its_config_is_written_when_that_is_asked_for(
    case: Case, bad: Diagnosis, tmp_path: Path
) -> None:
    path = tmp_path / "better.yaml"
    with pytest.raises(ConfigError, match=TOLD) as refused:
        save_config(path, case, bad)
    assert "unconfirmed=True of save_config" in str(refused.value)
    assert not path.exists()
    save_config(path, case, bad, unconfirmed=True)
    assert "viscous_friction" in path.read_text(encoding="utf-8")


def with_textbook(found: Diagnosis, left: float) -> Diagnosis:
    error = replace(found.after, mean_relative_moving=left)
    named = tuple(replace(each.effect, kind="coulomb_friction") for each in found.effects)
    return replace(found, textbook=Textbook(named, error))


def test_an_answer_that_the_textbook_beats_is_bad_and_the_textbook_is_offered(
    case: Case, tmp_path: Path
) -> None:
    """From two per cent on: it is said first, and `--apply` writes the textbook's effects."""
    plain = make_diagnosis(rivals=())
    fallen = replace(plain, before=replace(plain.before, mean_relative=1.0))
    after = fallen.after.mean_relative_moving
    assert with_textbook(fallen, after / 1.019).good
    worse = with_textbook(fallen, after / 1.021)
    assert worse.fell
    assert not worse.good
    told = no_gain_in_words(worse)
    assert told.startswith("The textbook model predicts ")
    assert (
        "residual is 11.75% of the torque with coulomb_friction on every joint, 12.00% with" in told
    )
    assert answer_in_words(worse) == told
    assert diagnosis_data(worse, {})["error"]["textbook"]["mean_relative_moving"] < after
    text = found_config(case.spec, case.folder, worse, tmp_path / "new.yaml", textbook=True)
    assert "coulomb_friction" in text
    assert "viscous_friction" not in text
    assert "of the textbook's model" in text
    both = with_textbook(replace(plain, before=plain.after), after / 1.021)
    assert no_gain_in_words(both).startswith(TOLD)
    assert "The textbook model predicts " in no_gain_in_words(both)


def test_whoever_plans_after_it_is_warned(case: Case, bad: Diagnosis) -> None:
    notes: list[Note] = []
    plan_after(case, bad, notes.append)
    assert notes[0].level is Level.WARNING
    assert notes[0].text.startswith(TOLD)
    good: list[Note] = []
    plan_after(case, make_diagnosis(rivals=()), good.append)
    assert not any("did not fall" in note.text for note in good)
