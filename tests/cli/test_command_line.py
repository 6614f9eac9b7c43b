"""Help, versions, mistypings, exit statuses: what every command has in common."""

import json
import subprocess
import sys
from importlib.metadata import version

import pytest
import typer.main

from excite_cli import __version__
from excite_cli.cli.app import app
from excite_cli.config.section import Section
from excite_cli.config.spec import Spec
from tests.cli.program import ROOT, SMOKE, Program

COMMANDS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
HEAVY = ("pinocchio", "coal", "scipy", "h5py", "numpy", "matplotlib", "viser", "mujoco", "yaml")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_an_example(excite: Program, command: str) -> None:
    run = excite.good(command, "--help")
    assert run.stderr == ""
    examples = run.stdout.partition("Examples:\n")[2].splitlines()
    assert examples[0].startswith(f"  excite {command}")
    assert all(len(line) <= 100 for line in run.stdout.splitlines())


def test_help_lists_every_command_and_has_an_example(excite: Program) -> None:
    run = excite.good("--help")
    assert "Examples:" in run.stdout
    assert all(command in run.stdout for command in COMMANDS)
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


@pytest.mark.parametrize("arguments", [["optimize", "--help"], ["--version"]])
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


def test_a_mistyped_command_is_told_with_all_commands(excite: Program) -> None:
    told = excite.refused("chek", SMOKE)
    assert "'chek'" in told
    assert "Did you mean 'check'?" in told
    assert all(command in told.split("?")[1] for command in COMMANDS)


def test_the_schema_has_all_sections_and_refuses_other_keys(excite: Program) -> None:
    schema = json.loads(excite.good("schema").stdout)
    assert schema["properties"].keys() == Spec.model_fields.keys()
    assert schema["required"] == ["robot"]
    assert {each.__name__ for each in Section.__subclasses__()} - {"Spec"} <= schema["$defs"].keys()
    for each in (schema, *schema["$defs"].values()):
        assert each["additionalProperties"] is False


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
