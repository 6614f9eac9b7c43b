"""What narrow terminals get: whole words, whole figures, and commands that can be pasted."""

import shlex
import subprocess
from pathlib import Path

import pytest
import typer.main
from rich.console import Console

from excite_cli.api.showing import Table
from excite_cli.cli.app import app
from excite_cli.cli.layout import copyable, rendered, wrapped
from tests.cli.conftest import Run
from tests.cli.program import BRIEF, EXCITE, SMOKE, Program, environment
from tests.cli.terminal import seen_on_a_terminal
from tests.cli.this_process import call

WIDTH = 60


def parts_of(table: Table, width: int) -> list[list[str]]:
    """Lines of every part of a table."""
    console = Console(width=width)
    found = []
    for part in rendered(table, width):
        with console.capture() as caught:
            console.print(part)
        found.append([line.rstrip() for line in caught.get().splitlines()])
    return found


FIGURES = Table(
    "",
    ("joint", "where", "before", "after it", "verdict"),
    (
        ("shoulder_pitch", "upper limit of the joint", "0.000482", "-1.4746e-05", "impossible"),
        ("elbow", "lower limit", "12.5", "3", "confirmed"),
    ),
    left=("joint", "verdict"),
    words=("where",),
)


def test_with_room_every_row_is_a_line_then_words_wrap_first() -> None:
    (lines,) = parts_of(FIGURES, 80)
    assert len(lines) == 4
    assert lines[2].split() == [word for cell in FIGURES.rows[0] for word in cell.split()]
    (lines,) = parts_of(FIGURES, 73)
    assert max(map(len, lines)) <= 73
    assert len(lines) > 4
    assert "upper limit of" in "\n".join(lines)


@pytest.mark.parametrize("width", [36, 40, 60])
def test_a_table_becomes_parts_that_name_their_rows(width: int) -> None:
    parts = parts_of(FIGURES, width)
    assert len(parts) > 1
    for lines in parts:
        assert max(map(len, lines)) <= width
        assert lines[0].startswith("joint")
        assert any(line.startswith("shoulder_pitch") for line in lines)
    shown = {word for lines in parts for line in lines for word in line.split()}
    assert {word for row in FIGURES.rows for cell in row for word in cell.split()} <= shown


def test_two_columns_name_rows_where_one_does_not() -> None:
    rows = tuple(("spring", f"joint_{n}", *["1234567890"] * 4) for n in range(3))
    table = Table("", ("effect", "where", *"abcd"), rows, left=("effect", "where"))
    parts = parts_of(table, 45)
    assert len(parts) == 2
    assert all("joint_2" in lines[-1] for lines in parts)


def test_a_name_wider_than_the_terminal_is_folded_and_not_cut() -> None:
    name = "x" * 50
    shown = parts_of(Table("", ("name", "figure"), ((name, "1.5"),), left=("name",)), 30)
    letters = "".join(line for lines in shown for line in lines)
    assert letters.count("x") == len(name)
    assert "1.5" in letters


def test_sentences_wrap_between_words() -> None:
    path = "/a/path/that/is/longer-than/the-terminal-is-wide.h5"
    lines = wrapped(f"There is no file {path}.\n\nLook again.", 30).splitlines()
    assert lines == ["There is no file", f"{path}.", "", "Look again."]


@pytest.mark.parametrize("width", [20, 40, 60, 79])
def test_a_command_can_be_pasted(width: int) -> None:
    words = ["excite", "optimize", "my robot's arm.yaml", "--after", "found.h5", "-o", "$x.h5"]
    words += ["--set", "effects=[{kind: spring}]", "--overwrite"]
    text = copyable(f"  {shlex.join(words)}", width)
    run = subprocess.run(
        ["sh", "-c", f"excite() {{ printf '%s\\n' excite \"$@\"; }}\n{text}"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.splitlines() == words
    assert all(line.startswith("  ") for line in text.splitlines())
    assert all(line.endswith(" \\") for line in text.splitlines()[:-1])
    assert "-o \\" not in text
    if width >= 40:
        assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize("command", typer.main.get_command(app).commands)  # type: ignore[attr-defined]
def test_pages_of_help_fit(command: str, excite: Program, cache: Path) -> None:
    variables = {**environment(cache), "COLUMNS": str(WIDTH)}
    run = call([command, "--help"], excite.folder, variables, 30.0)
    # A word of an example that is longer than the terminal stays whole.
    long = [line for line in run.stdout.splitlines() if len(line) > WIDTH]
    assert [line for line in long if len(line.split()[-1]) < WIDTH - 20] == []
    assert set(excite(command, "--help").stdout.split()) <= set(run.stdout.split())


@pytest.mark.parametrize(
    "command",
    [
        ("robots",),
        ("robots", SMOKE.parents[1] / "data" / "smoke_arm.urdf"),
        ("verify-gradient", SMOKE),
        ("check", SMOKE, "ARM", "--no-meshes", "--rate", "20"),
    ],
)
def test_answers_of_commands_keep_all_their_words(
    command: tuple[object, ...], excite: Program, two_motions: Run, cache: Path
) -> None:
    words = [str(two_motions.path) if word == "ARM" else str(word) for word in command]
    wide = excite.good(*words)
    narrow = call(words, excite.folder, {**environment(cache), "COLUMNS": str(WIDTH)}, 120.0)
    assert narrow.returncode == 0, narrow.stderr
    # The name of a file that is longer than the terminal stays whole, alone on its line.
    lines = [each for each in narrow.stdout.splitlines() if len(each.strip(" \\").split()) > 1]
    assert max(map(len, lines)) <= WIDTH
    assert _words(wide.stdout) <= _words(narrow.stdout)


def _words(text: str) -> set[str]:
    """Without rules and measured times."""
    return {word for word in text.split() if word.strip("─") and not word[:1].isdecimal()}


@pytest.mark.long
def test_progress_and_messages_fit_on_a_terminal(excite: Program, cache: Path) -> None:
    """What a terminal of 60 columns shows while motions are optimised: no line is cut off."""
    words = [*EXCITE, "optimize", str(SMOKE), "-o", "arm.h5", *BRIEF, "--motions", "1"]
    _, shown = seen_on_a_terminal(words, WIDTH, excite.folder, environment(cache))
    assert "motion 1 of 1: condition number" in shown
    assert "motion 1: condition number" in shown
    assert "…" not in shown
    assert max(map(len, shown.splitlines())) <= WIDTH
    _, again = seen_on_a_terminal(words, WIDTH, excite.folder, environment(cache))
    assert " ".join(again.split()).endswith(  # after lines that are gone by then
        "error: arm.h5 exists already. Give another name with -o, go on with --resume, or replace "
        "it with --overwrite."
    )
    assert max(map(len, again.splitlines())) <= WIDTH
