"""Every example of every page of help runs as it is written, in one folder.

The config has the name that the examples use and describes the small arm, with the joint names of
a UR10, so that all of them together take seconds. An example may need a file that another one
writes: what fails is tried again as long as something new succeeds.
"""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main

from excite_cli.cli.app import _COMMANDS, app
from tests.cli.program import ROOT, environment

JOINTS = {
    "shoulder_yaw": "shoulder_pan_joint",
    "shoulder_pitch": "shoulder_lift_joint",
    "elbow": "elbow_joint",
    "wrist_roll": "wrist_1_joint",
}
CONFIG = """\
robot: {urdf: arm.urdf, posture: {shoulder_lift_joint: 0.6, elbow_joint: 0.8, slide: 0.05}}
trajectory: {family: fourier, harmonics: 4, base_frequency: 1.0471975511965976}
constraints:
  joint_limits: {acceleration: 10.0}
  torque: {scale: 0.9}
optimizer: {max_iterations: 4}
diagnosis: {rounds: 3}
sequence: {motions: 2}
seed: 1
"""
# One process for all, since starting takes longer than most of them: the console script's own
# entry point is called with each list of words.
DRIVER = """\
import contextlib, io, json, sys
from excite_cli.cli.app import main
failed = []
for pending in json.load(sys.stdin):
    left = []
    while pending:
        left = []
        for words in pending:
            sys.argv, told, status = words, io.StringIO(), 0
            with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
                try:
                    main()
                except SystemExit as end:
                    status = end.code
            if status and "(--max-rounds) is spent" not in told.getvalue():
                left.append((words, status, told.getvalue()))
        if len(left) == len(pending):
            break
        pending = [words for words, _, _ in left]
    failed += left
print(json.dumps(failed))
"""


def examples() -> dict[str, list[list[str]]]:
    """Words of every example, by command."""
    found = {}
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        text = (command.epilog or "").replace("\\\n", " ")
        found[name] = [shlex.split(line) for line in text.splitlines() if line.strip()]
    return found


def playable(words: list[str]) -> list[str]:
    """An example as it can be tried here: less is repeated, pictures are small and not served."""
    if "--repeat" in words:
        at = words.index("--repeat") + 1
        return [*words[:at], "2", *words[at + 1 :]]
    if words[1] == "campaign":
        return [*words, "--max-rounds", "1", "-o", "campaign_of_examples"]
    if words[1] != "view":
        return [*words, "--overwrite"] if words[1] == "init" else words
    small = ["--size", "160x120"]
    if "--gif" in words:
        return [*words, *small, "--duration", "0.2"]
    return [*words, *small] if "--png" in words else [*words, *small, "--png", "seen.png"]


def alone(words: list[str]) -> bool:
    """Whether an example needs neither a program of the reader's nor a person."""
    return "--inbox" not in words and not any("{motion}" in word for word in words)


@pytest.mark.parametrize("command", _COMMANDS)
def test_every_command_has_examples_of_its_own_that_fit_on_a_terminal(command: str) -> None:
    lines = examples()[command]
    assert lines, f"`excite {command} --help` has no example: end its docstring with `Example:`"
    assert all(words[:2] == ["excite", command] for words in lines), lines
    text = typer.main.get_command(app).commands[command].epilog  # type: ignore[attr-defined]
    assert max(map(len, text.splitlines())) <= 78


def test_all_examples_run(tmp_path: Path, cache: Path) -> None:
    urdf = (ROOT / "data" / "smoke_arm.urdf").read_text(encoding="utf-8")
    for ours, theirs in JOINTS.items():
        urdf = re.sub(rf'(<joint name=)"{ours}"', rf'\1"{theirs}"', urdf)
    (tmp_path / "arm.urdf").write_text(urdf, encoding="utf-8")
    argument = '<xacro:arg name="gripper" default="two_fingers"/>'
    xacro = urdf.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1)
    xacro = xacro.replace("</robot>", f"{argument}</robot>")
    (tmp_path / "arm.urdf.xacro").write_text(xacro, encoding="utf-8")
    (tmp_path / "ur10.yaml").write_text(CONFIG, encoding="utf-8")
    found = examples()
    last = found.pop("init", [])  # it writes another ur10.yaml
    first = [playable(words) for each in found.values() for words in each if alone(words)]
    lines = [first, [playable(words) for words in last]]
    run = subprocess.run(
        [sys.executable, "-c", DRIVER],
        input=json.dumps(lines),
        cwd=tmp_path,
        env=environment(cache),
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    failed = json.loads(run.stdout)
    told = [f"{shlex.join(words)} (status {status}): {said}" for words, status, said in failed]
    assert not failed, "\n".join(told)
