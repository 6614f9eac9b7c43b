"""A field that is added to a record needs one line there and one in the document."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import h5py
import pytest

from excite_cli.cli.console import Terminal
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.fields import PUBLIC
from excite_cli.report.page import render
from excite_cli.shown.answer import Detail, Section
from excite_cli.store.codec import read_record, write_record
from excite_cli.summary import diagnosis
from excite_cli.summary.assembly import Source, page_of
from excite_cli.summary.diagnosis import diagnosis_answer, diagnosis_data
from tests.diagnosis.synthetic_diagnosis import make_diagnosis
from tests.report.structure import Structure

SENTENCE = "The motors were at 41.5 °C."


@dataclass(frozen=True, repr=False)
class Warm(Diagnosis):
    """A diagnosis that also knows how warm the motors were [°C]: the change of the record."""

    temperature: Annotated[float, PUBLIC] = 20.0


def temperature_section(found: Diagnosis, _: Detail) -> Section:
    """The change of the document."""
    assert isinstance(found, Warm)
    told = f"The motors were at {found.temperature:g} °C."
    return Section("diagnosis-temperature", "Temperature", (told,))


@pytest.fixture
def warm(monkeypatch: pytest.MonkeyPatch) -> Warm:
    monkeypatch.setattr(diagnosis, "SECTIONS", [*diagnosis.SECTIONS, temperature_section])
    plain = make_diagnosis()
    known = {field.name: getattr(plain, field.name) for field in fields(plain)}
    return Warm(**known, temperature=41.5)


def test_terminal_notebook_and_page_say_it(warm: Warm, capsys: pytest.CaptureFixture[str]) -> None:
    Terminal().show(diagnosis_answer(warm, "arm.yaml", {}))
    assert SENTENCE in capsys.readouterr().out
    assert f"<p>{SENTENCE}</p>" in str(warm._repr_html_())
    page = page_of([Source("d", "d.h5", warm)], lambda name, done: None)
    assert SENTENCE in Structure(render(page)).text


def test_scripts_see_it_beside_all_they_saw(warm: Warm) -> None:
    data = diagnosis_answer(warm, "arm.yaml", {}).data
    plain = diagnosis_data(make_diagnosis(), data["next_experiment"])
    assert data["temperature"] == 41.5
    assert data.keys() - plain.keys() == {"temperature", "output"}


def test_a_file_holds_it_and_older_files_have_its_default(warm: Warm, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "d.h5", "w") as file:
        write_record(file, warm)
        assert read_record(file, Warm).temperature == 41.5
        del file.attrs["temperature"]
        assert read_record(file, Warm).temperature == 20.0
