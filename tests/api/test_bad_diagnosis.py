"""A diagnosis that does not lower the sealed error is not built upon unasked."""

from dataclasses import replace
from pathlib import Path

import pytest

from excite_cli import Case, ConfigError, plan_after, save_config
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.robot.model import build_robot
from excite_cli.shown.note import Level, Note
from tests.diagnosis.synthetic_diagnosis import CONFIG, make_diagnosis, smoke_spec

TOLD = "The sealed error did not fall: 10.00% before, 10.00% after"


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


def test_whoever_plans_after_it_is_warned(case: Case, bad: Diagnosis) -> None:
    notes: list[Note] = []
    plan_after(case, bad, notes.append)
    assert notes[0].level is Level.WARNING
    assert notes[0].text.startswith(TOLD)
    good: list[Note] = []
    plan_after(case, make_diagnosis(rivals=()), good.append)
    assert not any("did not fall" in note.text for note in good)
