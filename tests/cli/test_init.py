"""`excite init` as a user runs it: a config that works with no edit, or one sentence."""

import contextlib
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.trust.robot_files import VALID
from excite_cli.config.load import load_spec
from tests.cli.program import BRIEF, Program
from tests.proposal.robots import GOOD, arm, joint, link, written
from tests.proposal.test_shapes import FINGERS, shape, with_gripper


def test_a_config_that_works_unedited(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path, 'lower="-2" upper="2" velocity="0" effort="1000"')
    answer = excite.answer("init", "--urdf", "robot.urdf", "-o", "arm.yaml")
    assert answer["joints"] == ["shoulder", "elbow"]
    assert load_spec(tmp_path / "arm.yaml").robot.urdf == "robot.urdf"
    made = excite("optimize", "arm.yaml", "-o", "arm.h5", *BRIEF)
    assert made.returncode == 0, made.stderr
    assert excite("check", "arm.yaml", "arm.h5").returncode == 0


def with_a_package(folder: Path) -> Path:
    """A robot whose mesh lies in a package beside its folder."""
    package = folder / "src" / "hand_description"
    (package / "meshes").mkdir(parents=True)
    (package / "meshes" / "l.stl").write_bytes(VALID["stl"])
    name = "package://hand_description/meshes/l.stl"
    mesh = f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'
    own = folder / "urdf"
    own.mkdir()
    written(own, link("base", shape=""), joint("j", "base", "l", GOOD), link("l", shape=mesh))
    return package


def test_what_lies_elsewhere_is_read_only_when_allowed(excite: Program, tmp_path: Path) -> None:
    package = with_a_package(tmp_path)
    run = excite("init", "--urdf", "urdf/robot.urdf", "-o", "arm.yaml")
    assert run.returncode == 2
    words = " ".join(run.stderr.split())
    assert f"asks for the package 'hand_description' in {package}" in words
    assert "--allow-found" in words
    assert not (tmp_path / "arm.yaml").exists()
    run = excite("init", "--urdf", "urdf/robot.urdf", "-o", "arm.yaml", "--allow-found")
    assert run.returncode == 0, run.stderr
    told = " ".join(run.stdout.split())
    assert f"allowed to read the package 'hand_description' in {package}" in told
    assert load_spec(tmp_path / "arm.yaml").robot.package_dirs == ("src/hand_description",)


@pytest.mark.parametrize(("answer", "status"), [("y", 0), ("n", 2)])
def test_a_terminal_is_asked(tmp_path: Path, answer: str, status: int) -> None:
    with_a_package(tmp_path)
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "excite_cli", "init", "--urdf", "urdf/robot.urdf", "-o", "arm.yaml"],
        cwd=tmp_path,
        stdin=theirs,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
    )
    os.close(theirs)
    os.write(ours, f"{answer}\n".encode())
    said = b""
    with contextlib.suppress(OSError):  # the other side is closed
        while read := os.read(ours, 65536):
            said += read
    os.close(ours)
    assert process.wait() == status
    assert b"outside its own folder. [y/N]" in said
    assert (tmp_path / "arm.yaml").exists() is (status == 0)


def test_it_says_what_it_chose(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path, 'lower="-2" upper="2" velocity="0" effort="50"')
    run = excite("init", "--urdf", "robot.urdf")
    assert run.returncode == 0, run.stderr
    assert "moves 2 joints" in run.stdout
    assert "shoulder: the URDF gives 0 rad/s; 3.1 rad/s assumed" in run.stdout
    assert "excite optimize robot.yaml" in run.stdout


def test_nothing_is_overwritten_unasked(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path)
    (tmp_path / "robot.yaml").write_text("mine")
    run = excite("init", "--urdf", "robot.urdf")
    assert run.returncode == 2
    assert "robot.yaml exists already" in run.stderr
    assert (tmp_path / "robot.yaml").read_text() == "mine"
    assert excite("init", "--urdf", "robot.urdf", "--overwrite").returncode == 0
    assert (tmp_path / "robot.yaml").read_text() != "mine"


def test_without_a_robot_and_a_terminal_it_does_not_hang(excite: Program) -> None:
    run = excite("init")
    assert run.returncode == 2
    assert "--robot NAME" in run.stderr
    assert "--urdf FILE" in run.stderr


def test_an_unknown_robot_is_told_with_the_nearest(excite: Program) -> None:
    run = excite("init", "--robot", "ur100")
    assert run.returncode == 2
    assert "Did you mean 'ur10'?" in run.stderr


def test_a_robot_given_as_an_argument_is_understood(excite: Program) -> None:
    run = excite("init", "panda")
    assert run.returncode == 2
    assert "--robot panda" in run.stderr


def test_a_wrong_name_is_told_before_the_work_begins(excite: Program) -> None:
    run = excite("init", "--robot", "ur11")
    assert run.returncode == 2
    assert "looking at" not in run.stderr
    assert "ur10" in run.stderr


def test_a_robot_that_cannot_move_is_one_sentence(excite: Program, tmp_path: Path) -> None:
    run = excite("init", "--robot", "iris_simple")
    assert run.returncode == 2
    told = run.stderr.splitlines()[1:]
    assert len(told) == 1
    assert "has no movable joint" in told[0]
    assert not (tmp_path / "iris_simple.yaml").exists()


def test_floating_base_measures_its_wrench(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path)
    assert excite("init", "--urdf", "robot.urdf", "--base", "floating").returncode == 0
    robot = load_spec(tmp_path / "robot.yaml").robot
    assert (robot.base, robot.rows) == ("floating", ("base", "joints"))


def test_what_init_writes_is_planned_and_checked(excite: Program, tmp_path: Path) -> None:
    with_gripper(tmp_path, shape(FINGERS.format("palm")))
    assert excite("init", "--urdf", "robot.urdf").returncode == 0
    assert len(load_spec(tmp_path / "robot.yaml").constraints.self_collision.without_shapes) == 2
    made = excite("optimize", "robot.yaml", "-o", "robot.h5", *BRIEF)
    assert made.returncode == 0, made.stderr
    checked = excite("check", "robot.yaml", "robot.h5")
    assert checked.returncode == 0, checked.stderr
    assert "NOT GUARDED: the meshes of palm, finger" in checked.stdout
