"""Mistyped names of every kind: one message, what was meant, exit status 2."""

import sys
from pathlib import Path

import pytest

from excite_cli.cli.app import main
from tests.cli.program import ROOT, SMOKE

CONFIGS = ROOT / "configs"
UR10, CELL = CONFIGS / "ur10.yaml", CONFIGS / "ur10_cell.yaml"


def told(
    words: list[str | Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> str:
    """What the program says on stderr; nothing else may be printed."""
    monkeypatch.setattr(sys, "argv", ["excite", *map(str, words)])
    monkeypatch.setenv("NO_COLOR", "1")
    with pytest.raises(SystemExit) as end:
        main()
    out, err = capsys.readouterr()
    assert end.value.code == 2, err
    assert out == ""
    last = [line for line in err.splitlines() if line.startswith("error: ")]
    assert len(last) == 1, err
    assert "\x1b" not in err
    assert not err.startswith("Usage:")
    return last[0]


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["optmize", SMOKE], "'optimize'"),
        (["optimize", SMOKE, "--overwite"], "'--overwrite'"),
        (["check", SMOKE, "x.h5", "--ranodm", "3"], "'--random'"),
        (["export", "x.h5", "--format", "rso2"], "'ros2'"),
        (["robots", "ur1O"], "'ur10'"),
        (["verify-gradient", UR10, "--set", "trajectory.harmoncs=3"], "'harmonics'"),
        (["verify-gradient", UR10, "--set", "robot.urdf=ur10"], "'example-robot-data:ur10'"),
        (["verify-gradient", UR10, "--set", "robot.urdf=example-robot-data:ur1O"], "'ur10'"),
        (["verify-gradient", UR10, "--set", "robot.joints=[elbo_joint]"], "'elbow_joint'"),
        (["verify-gradient", UR10, "--set", "robot.posture={elbow: 1}"], "'elbow_joint'"),
        (["verify-gradient", UR10, "--set", "robot.limits={elbo: {velocity: 1}}"], "'elbow_joint'"),
        (["verify-gradient", UR10, "--set", "effects=[{kind: sprin}]"], "'spring'"),
        (["verify-gradient", UR10, "--set", "constraints.torqe.scale=1"], "'torque'"),
        (["verify-gradient", UR10, "--set", "constraints.balance.kind=dsc"], "'disc'"),
        (["verify-gradient", CELL, "--set", "robot.payload.link=tool1"], "'tool0'"),
    ],
)
def test_a_mistyped_name_is_answered_with_the_nearest(
    words: list[str | Path],
    meant: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert f"Did you mean {meant}?" in told(words, capsys, monkeypatch)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["optimize"], "excite optimize: CONFIG is missing. Usage: excite optimize CONFIG"),
        (["optimize", SMOKE, "--seed"], "--seed needs a value."),
        (["optimize", SMOKE, "--seed", "-1"], "--seed: "),
        (["optimize", SMOKE, SMOKE], "unexpected: "),
        (["export", "x.h5"], "excite export: --format is missing. Usage: excite export FILE --for"),
        (["optimize", "."], ". is a folder, not a config."),
        (["optimize", "x.yaml"], "There is no config file x.yaml."),
        (["robots", "."], ". is a folder. Give a URDF file"),
    ],
)
def test_what_is_missing_or_of_another_kind(
    words: list[str | Path],
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in told(words, capsys, monkeypatch)


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["init", "my arm's.urdf"], "--urdf 'my arm'\"'\"'s.urdf'?"),
        (["init", "my", "arm.urdf"], "--urdf NAME?"),
    ],
)
def test_a_suggested_name_is_quoted_for_a_shell(
    words: list[str | Path],
    meant: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert told(words, capsys, monkeypatch).endswith(meant)


def test_a_key_is_told_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "robot: {urdf: example-robot-data:ur10}\nseed: 1\ntrajectory:\n  harmoncs: 3\n"
    (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    message = told(["verify-gradient", "arm.yaml"], capsys, monkeypatch)
    assert message.startswith("error: arm.yaml, line 4: trajectory.harmoncs: unknown key.")
    assert "Did you mean 'harmonics'? Allowed here: " in message
    (tmp_path / "arm.yaml").write_text(text.replace("harmoncs: 3", "family: fourier"))
    message = told(["verify-gradient", "arm.yaml", "--set", "seed=x"], capsys, monkeypatch)
    assert "line" not in message  # it is not the file that says so


def test_three_numbers_are_asked_for_where_two_are_given(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["verify-gradient", CELL, "--set", "robot.payload.start=[0, 0]"]
    message = told(words, capsys, monkeypatch)
    assert "robot.payload.start: 3 values needed (given: 2)." in message
