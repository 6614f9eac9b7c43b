"""Help, versions, mistypings, exit statuses: what every command has in common."""

import json
import subprocess
import sys
from importlib.metadata import version

import pytest
import typer.main

from excite_cli import __version__
from excite_cli.cli.app import app
from tests.cli.program import ROOT, SMOKE, Program

COMMANDS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
HEAVY = ("pinocchio", "coal", "scipy", "h5py", "numpy", "matplotlib", "viser", "mujoco", "yaml")


def test_there_are_commands() -> None:
    assert {"optimize", "verify-gradient", "compare-random", "check", "schema"} <= set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_an_example(excite: Program, command: str) -> None:
    run = excite(command, "--help")
    assert run.returncode == 0
    assert run.stderr == ""
    examples = run.stdout.partition("Examples:\n")[2].splitlines()
    assert examples[0].startswith(f"  excite {command}")
    assert all(len(line) <= 100 for line in run.stdout.splitlines())


def test_help_lists_every_command_and_has_an_example(excite: Program) -> None:
    run = excite("--help")
    assert run.returncode == 0
    assert "Examples:" in run.stdout
    for command in COMMANDS:
        assert command in run.stdout
    assert excite("-h").stdout == run.stdout


def test_no_arguments_shows_the_help(excite: Program) -> None:
    run = excite()
    assert run.returncode in (0, 2)
    assert "Usage:" in run.stdout + run.stderr
    assert "bug" not in run.stderr


def test_version(excite: Program) -> None:
    run = excite("--version")
    assert (run.returncode, run.stdout.strip()) == (0, f"excite {__version__}")
    assert version("excite-cli") == __version__


def test_the_package_runs_as_a_module() -> None:
    run = subprocess.run(
        [sys.executable, "-m", "excite_cli", "--version"], capture_output=True, text=True, cwd=ROOT
    )
    assert (run.returncode, run.stdout.strip()) == (0, f"excite {__version__}")


@pytest.mark.parametrize("arguments", [["--help"], ["optimize", "--help"], ["--version"]])
def test_answers_that_need_no_mathematics_load_none(arguments: list[str]) -> None:
    code = (
        "import sys\n"
        "from excite_cli.cli.app import main\n"
        f"sys.argv = ['excite', *{arguments!r}]\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        f"    print('loaded:', *[m for m in {HEAVY!r} if m in sys.modules], file=sys.stderr)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.stderr.strip() == "loaded:"


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("optmize", "optimize"), ("verify-gradiant", "verify-gradient"), ("chek", "check")],
)
def test_a_mistyped_command(excite: Program, wrong: str, right: str) -> None:
    run = excite(wrong, SMOKE)
    assert run.returncode == 2
    assert f"'{wrong}'" in run.stderr
    assert f"Did you mean '{right}'?" in run.stderr
    for command in COMMANDS:
        assert command in run.stderr.split("?")[1]
    assert run.stdout == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["optimize"], "config"),
        (["optimize", SMOKE, "--montions", "3"], "--motions"),
        (["optimize", SMOKE, "--motions", "0"], "--motions"),
        (["optimize", SMOKE, "--motions", "some"], "--motions"),
        (["optimize", SMOKE, "--seed", "-1"], "--seed"),
        (["optimize", SMOKE, SMOKE], "unexpected"),
        (["check", SMOKE], "file"),
        (["check", SMOKE, "none.h5", "--rate", "0"], "--rate"),
        (["schema", "--jsno"], "--jsno"),
    ],
)
def test_wrong_options_and_arguments(excite: Program, arguments: list[str], words: str) -> None:
    run = excite(*arguments)
    assert run.returncode == 2
    assert words in run.stderr.lower()
    assert "bug" not in run.stderr
    assert "Traceback" not in run.stderr
    assert run.stdout == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["optimize", "none.yaml"], "There is no config file none.yaml"),
        (["optimize", SMOKE, "-o", "."], "is a folder"),
        (["optimize", SMOKE, "--set", "robot.urdf=example-robot-data:talso"], "'talos'"),
        (["verify-gradient", SMOKE, "--set", "sampling.cost.step=0.2"], "sampling.cost: 60"),
        (["compare-random", SMOKE, "--optimized", "none.h5"], "There is no file none.h5"),
        (["check", SMOKE, "none.h5"], "There is no file none.h5"),
    ],
)
def test_bad_input_is_one_message_and_status_2(
    excite: Program, arguments: list[str], words: str
) -> None:
    run = excite(*arguments)
    assert run.returncode == 2
    assert words in run.stderr
    last = run.stderr.splitlines()[-1]
    assert last.startswith("error: ")
    assert "Traceback" not in run.stderr
    assert run.stdout == ""
    assert list(excite.folder.iterdir()) == []


def test_a_reader_that_goes_away_is_no_error(excite: Program) -> None:
    """`excite schema | head -1`."""
    process = excite.start("schema")
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.read(1)
    process.stdout.close()
    told = process.stderr.read()
    process.stderr.close()
    process.wait(timeout=60)
    assert "Traceback" not in told
    assert "bug" not in told


def test_schema_prints_json(excite: Program) -> None:
    run = excite("schema")
    assert run.returncode == 0
    assert "robot" in json.loads(run.stdout)["properties"]


def test_robots_lists_names_that_can_be_used(excite: Program) -> None:
    listed = excite.answer("robots")["robots"]
    assert "example-robot-data:ur10" in listed
    assert "example-robot-data:talos" in listed


def test_robots_of_a_file_have_null_for_what_has_no_bound(excite: Program) -> None:
    joints = excite.answer("robots", ROOT / "data" / "smoke_arm.urdf")["joints"]
    assert list(joints) == ["shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide"]
    assert joints["slide"]["lower"] == 0
    assert joints["slide"]["upper"] > 0
    assert joints["wrist_roll"]["lower"] is None
    assert joints["wrist_roll"]["upper"] is None
