"""Mistyped, missing and impossible words of every kind: one message, what was meant, status 2."""

import pytest

from tests.cli.program import ROOT, SMOKE, Program

UR10, CELL = ROOT / "configs" / "ur10.yaml", ROOT / "configs" / "ur10_cell.yaml"


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["optimize", SMOKE, "--overwite"], "'--overwrite'"),
        (["check", SMOKE, "x.h5", "--ranodm", "3"], "'--random'"),
        (["schema", "--jsno"], "'--json'"),
        (["export", "x.h5", "--format", "rso2"], "'ros2'"),
        (["robots", "ur1O"], "'ur10'"),
        ([UR10, "--set", "trajectory.harmoncs=3"], "'harmonics'"),
        ([UR10, "--set", "robot.urdf=ur10"], "'example-robot-data:ur10'"),
        ([UR10, "--set", "robot.urdf=example-robot-data:ur1O"], "'ur10'"),
        ([UR10, "--set", "robot.joints=[elbo_joint]"], "'elbow_joint'"),
        ([UR10, "--set", "robot.posture={elbow: 1}"], "'elbow_joint'"),
        ([UR10, "--set", "robot.limits={elbo: {velocity: 1}}"], "'elbow_joint'"),
        ([UR10, "--set", "effects=[{kind: sprin}]"], "'spring'"),
        ([UR10, "--set", "constraints.torqe.scale=1"], "'torque'"),
        ([UR10, "--set", "constraints.balance.kind=dsc"], "'disc'"),
        ([CELL, "--set", "robot.payload.link=tool1"], "'tool0'"),
    ],
)
def test_a_mistyped_name_is_answered_with_the_nearest(
    words: list[str], meant: str, excite: Program
) -> None:
    command = [] if isinstance(words[0], str) else ["verify-gradient"]
    assert f"Did you mean {meant}?" in excite.refused(*command, *words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["optimize"], "excite optimize: CONFIG is missing. Usage: excite optimize CONFIG"),
        (["optimize", SMOKE, "--motions", "0"], "--motions: "),
        (["optimize", SMOKE, "--motions", "some"], "--motions: "),
        (["optimize", SMOKE, "--seed"], "--seed needs a value."),
        (["optimize", SMOKE, "--seed", "-1"], "--seed: "),
        (["optimize", SMOKE, SMOKE], "unexpected: "),
        (["optimize", SMOKE, "-o", "."], ". is a folder"),
        (["optimize", "."], ". is a folder, not a config."),
        (["check", SMOKE], "FILE is missing."),
        (["check", SMOKE, "none.h5", "--rate", "0"], "--rate"),
        (["compare-random", SMOKE, "--optimized", "none.h5"], "There is no file none.h5"),
        (["export", "x.h5"], "excite export: --format is missing. Usage: excite export FILE --for"),
        (["robots", "."], ". is a folder. Give a URDF file"),
        (["verify-gradient", SMOKE, "--set", "sampling.cost.step=0.2"], "sampling.cost: 60"),
        (
            ["verify-gradient", CELL, "--set", "robot.payload.start=[0, 0]"],
            "robot.payload.start: 3 values needed (given: 2).",
        ),
        # A suggested name is quoted for a shell.
        (["init", "my arm's.urdf"], "--urdf 'my arm'\"'\"'s.urdf'?"),
        (["init", "my", "arm.urdf"], "--urdf NAME?"),
    ],
)
def test_what_is_missing_or_of_another_kind(words: list[str], said: str, excite: Program) -> None:
    assert said in excite.refused(*words)
    assert list(excite.folder.iterdir()) == []


def test_a_key_is_told_with_its_line(excite: Program) -> None:
    text = "robot: {urdf: example-robot-data:ur10}\nseed: 1\ntrajectory:\n  harmoncs: 3\n"
    (excite.folder / "arm.yaml").write_text(text, encoding="utf-8")
    message = excite.refused("verify-gradient", "arm.yaml")
    assert message.startswith("error: arm.yaml, line 4: trajectory.harmoncs: unknown key.")
    assert "Did you mean 'harmonics'? Allowed here: " in message
    (excite.folder / "arm.yaml").write_text(text.replace("harmoncs: 3", "family: fourier"))
    message = excite.refused("verify-gradient", "arm.yaml", "--set", "seed=x")
    assert "line" not in message  # it is not the file that says so
