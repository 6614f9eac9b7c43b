"""Names that begin with a minus: given to the program, suggested by it, and how to give them."""

import re
import shutil

import pytest

from excite_cli.cli.app import app
from excite_cli.shown import answer
from tests.cli.program import BRIEF, ROOT, SMOKE, Program

# Options without which a command does not begin.
NEEDED = {
    "export": ["-f", "csv"],
    "campaign": ["--measure", "x {motion} {data}"],
    "study": ["--vary", "seed=1,2"],
}
WITH_FILES = sorted(
    str(each.name) for each in app.registered_commands if each.name not in ("init", "schema")
)


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
def test_a_name_taken_for_an_option_is_said(words: list[str], said: str, excite: Program) -> None:
    for name in ("-lead.yaml", "-o.yaml", "--twice.yaml"):
        shutil.copy(SMOKE, excite.folder / name)
    assert re.search(said, excite.refused(*words))


@pytest.mark.parametrize("words", [["optimize", "-o", "-lead.yaml"], ["check", "x", "-n", "y"]])
def test_values_and_mistyped_options_are_not_taken_for_names(
    words: list[str], excite: Program
) -> None:
    shutil.copy(SMOKE, excite.folder / "-lead.yaml")
    assert "begins with a minus" not in excite.refused(*words)


@pytest.mark.parametrize("name", WITH_FILES)
def test_every_command_takes_names_after_two_minuses(name: str, excite: Program) -> None:
    said = excite.refused(name, *NEEDED.get(name, ()), "--", "-lead.yaml")
    assert "no option" not in said
    assert "-lead.yaml" in said or "is missing" in said


def test_files_and_joints_with_a_minus_go_through(excite: Program) -> None:
    text = (ROOT / "data" / "smoke_arm.urdf").read_text().replace("elbow", "-lead")
    (excite.folder / "-arm.urdf").write_text(text)
    joints = ("--joints", "shoulder_yaw,-lead")
    made = excite.good("init", "--urdf", "-arm.urdf", "-o", "-lead.yaml", *joints)
    assert "excite optimize ./-lead.yaml" in made.stdout
    for words in (
        ("optimize", "-o", "-lead.h5", "--motions", "1", "-q", *BRIEF, "--", "-lead.yaml"),
        ("simulate", "-o", "-d.h5", "--effect", "spring@-lead=3", "--", "-lead.yaml", "-lead.h5"),
        ("export", "-f", "csv", "-o", "-m.csv", "--entry", "--from", "-lead=0.3", "--", "-lead.h5"),
        ("check", "-q", "--", "-lead.yaml", "-m.csv"),
    ):
        excite.good(*words)


def test_a_suggested_command_can_be_pasted() -> None:
    assert answer.as_word("-lead.yaml") == "./-lead.yaml"
    assert answer.as_word("arm.yaml") == "arm.yaml"
    assert answer.as_word("./-lead.yaml") == "./-lead.yaml"
    words = ("excite", "optimize", answer.as_word("-my arm.yaml"))
    assert answer.Command(words).line == "excite optimize './-my arm.yaml'"
