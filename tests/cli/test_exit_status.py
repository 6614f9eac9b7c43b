"""How commands end: the message of a bug, of what is refused, and errors as JSON."""

import json
import sys

import pytest

from excite_cli.cli.exit_status import BUG, run_guarded
from tests.cli.conftest import Run
from tests.cli.program import SMOKE, Program

NO_MOTION = "--motions 1 --set constraints.joint_limits.acceleration=1e-9"


def fail() -> None:
    raise ZeroDivisionError("by nothing")


def stop() -> None:
    raise KeyboardInterrupt


def test_a_bug_says_how_to_report_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["excite", "optimize"])
    assert run_guarded(fail) == BUG
    told = capsys.readouterr().err
    assert "a bug of excite, not of your input (ZeroDivisionError at test_exit_status.py:" in told
    assert "--verbose" in told
    assert "Traceback" not in told
    monkeypatch.setattr(sys, "argv", ["excite", "optimize", "--verbose"])
    assert run_guarded(fail) == BUG
    assert "Traceback" in capsys.readouterr().err


def test_a_refusal_of_the_file_system_is_no_bug(capsys: pytest.CaptureFixture[str]) -> None:
    def refuse() -> None:
        raise PermissionError(13, "Permission denied", "/there/x.h5")

    assert run_guarded(refuse) == 2
    assert capsys.readouterr().err.startswith("error: /there/x.h5: no permission.")


@pytest.mark.parametrize(
    ("words", "kind", "status", "said"),
    [
        ("optmize", "ConfigError", 2, "there is no command 'optmize'. Did you mean 'optimize'?"),
        ("optimize", "ConfigError", 2, "excite optimize: CONFIG is missing."),
        ("optimize CONFIG --foo", "ConfigError", 2, "there is no option --foo."),
        ("optimize CONFIG --seed x", "ConfigError", 2, "--seed: "),
        ("optimize CONFIG --set sed=1 -o x.h5", "ConfigError", 2, "Did you mean 'seed'?"),
        ("optimize none.yaml", "ConfigError", 2, "There is no config file none.yaml."),
        ("robots none", "RobotError", 2, "neither a robot nor a file 'none'"),
        ("check CONFIG none.h5", "FileError", 2, "There is no file none.h5."),
        ("identify CONFIG RESULT", "FileError", 2, "holds planned motions, not measured data."),
        (f"optimize CONFIG -o x.h5 {NO_MOTION}", "NoAdmissibleMotionError", 1, "No motion"),
    ],
)
def test_errors_are_json_where_answers_are(
    words: str, kind: str, status: int, said: str, excite: Program, two_motions: Run
) -> None:
    places = {"CONFIG": str(SMOKE), "RESULT": str(two_motions.path)}
    arguments = [places.get(word, word) for word in words.split()]
    plain, run = excite(*arguments), excite(*arguments, "--json")
    assert run.returncode == plain.returncode == status
    assert run.stdout == ""
    told = json.loads(run.stderr.splitlines()[-1])
    assert told.keys() == {"error", "kind", "exit_status"}
    assert (told["kind"], told["exit_status"]) == (kind, status)
    assert said in told["error"]
    assert f"error: {told['error']}" in plain.stderr
    assert "error: " not in run.stderr


def test_a_bug_and_an_interruption_are_json_too(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["excite", "optimize", "--json"])
    cases = ((fail, "ZeroDivisionError", BUG), (stop, "KeyboardInterrupt", 130))
    for action, kind, status in cases:
        assert run_guarded(action) == status
        out, err = capsys.readouterr()
        assert out == ""
        told = json.loads(err)
        assert (told["kind"], told["exit_status"]) == (kind, status)
