"""Names that begin with a minus: given to the program, suggested by it, and how to give them."""

import re
import shutil
import sys
from pathlib import Path

import pytest

from excite_cli.cli.app import app, main
from excite_cli.shown import answer
from tests.cli.program import BRIEF, ROOT, SMOKE, Program
from tests.cli.test_suggestions import told

# Options without which a command does not begin.
NEEDED = {
    "export": ["-f", "csv"],
    "campaign": ["--measure", "x {motion} {data}"],
    "study": ["--vary", "seed=1,2"],
}
WITH_FILES = sorted(
    str(each.name) for each in app.registered_commands if each.name not in ("init", "schema")
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of files whose names begin with a minus."""
    monkeypatch.chdir(tmp_path)
    for name in ("-lead.yaml", "-o.yaml", "--twice.yaml"):
        shutil.copy(SMOKE, name)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["check", "-lead.yaml", "x.h5"], r"no option -l\. .*'-lead\.yaml' .*\./-lead\.yaml"),
        (["check", "-gone.yaml", "x.h5"], r"no option -g\. .*'-gone\.yaml' .*\./-gone\.yaml"),
        (["optimize", "-o.yaml"], r"CONFIG is missing\..*'-o\.yaml' .*\./-o\.yaml"),
        (["check", "--twice.yaml", "x.h5"], r"'--twice\.yaml' .*\./--twice\.yaml"),
        (["export", "--", "-m.h5", "-f", "csv"], r"--format is missing\..*put -f before it"),
        (
            ["check", "--", "-lead.yaml", "x", "--quiet"],
            r"unexpected: --quiet\..*put --quiet before",
        ),
    ],
)
def test_a_name_taken_for_an_option_is_said(
    words: list[str],
    said: str,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert re.search(said, told([*words], capsys, monkeypatch))


@pytest.mark.parametrize("words", [["optimize", "-o", "-lead.yaml"], ["check", "x", "-n", "y"]])
def test_values_and_mistyped_options_are_not_taken_for_names(
    words: list[str],
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert "begins with a minus" not in told([*words], capsys, monkeypatch)


@pytest.mark.parametrize("name", WITH_FILES)
def test_every_command_takes_names_after_two_minuses(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["excite", name, *NEEDED.get(name, ()), "--", "-lead.yaml"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as end:
        main()
    said = capsys.readouterr().err
    assert end.value.code == 2
    assert "no option" not in said
    assert "-lead.yaml" in said or "is missing" in said


def test_files_and_joints_with_a_minus_go_through(excite: Program) -> None:
    text = (ROOT / "data" / "smoke_arm.urdf").read_text().replace("elbow", "-lead")
    (excite.folder / "-arm.urdf").write_text(text)
    made = excite(
        "init", "--urdf", "-arm.urdf", "-o", "-lead.yaml", "--joints", "shoulder_yaw,-lead"
    )
    assert made.returncode == 0, made.stderr
    assert "excite optimize ./-lead.yaml" in made.stdout
    small = ("-o", "-lead.h5", "--motions", "1", "-q", *BRIEF)
    planned = excite("optimize", *small, "--", "-lead.yaml")
    assert planned.returncode == 0, planned.stderr
    for words in (
        ("simulate", "-o", "-d.h5", "--effect", "spring@-lead=3", "--", "-lead.yaml", "-lead.h5"),
        ("export", "-f", "csv", "-o", "-m.csv", "--entry", "--from", "-lead=0.3", "--", "-lead.h5"),
        ("check", "-q", "--", "-lead.yaml", "-m.csv"),
    ):
        run = excite(*words)
        assert run.returncode == 0, run.stderr


def test_a_suggested_command_can_be_pasted() -> None:
    assert answer.as_word("-lead.yaml") == "./-lead.yaml"
    assert answer.as_word("arm.yaml") == "arm.yaml"
    assert answer.as_word("./-lead.yaml") == "./-lead.yaml"
    words = ("excite", "optimize", answer.as_word("-my arm.yaml"))
    assert answer.Command(words).line == "excite optimize './-my arm.yaml'"
