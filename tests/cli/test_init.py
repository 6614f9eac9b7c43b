"""`excite init` as a user runs it: a config that works with no edit, or one sentence."""

from pathlib import Path

import pytest

from benchmarks.trust.robot_files import VALID
from excite_cli.config.load_spec import load_spec
from tests.cli.program import BRIEF, EXCITE, Program, environment
from tests.cli.terminal import seen_on_a_terminal
from tests.proposal.robots import GOOD, arm, joint, link, written
from tests.proposal.test_shapes import FINGERS, shape, with_gripper


def test_a_config_that_works_unedited(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path, 'lower="-2" upper="2" velocity="0" effort="1000"')
    (tmp_path / "arm.yaml").write_text("mine")
    words = ("init", "--urdf", "robot.urdf", "-o", "arm.yaml")
    assert "arm.yaml exists already" in excite.refused(*words)
    assert (tmp_path / "arm.yaml").read_text() == "mine"
    answer = excite.answer(*words, "--overwrite")
    assert answer["joints"] == ["shoulder", "elbow"]
    told = excite.good("init", "--urdf", "robot.urdf").stdout
    assert "moves 2 joints" in told
    assert "shoulder: the URDF gives 0 rad/s; 3.1 rad/s assumed" in told
    assert "excite optimize robot.yaml" in told
    assert load_spec(tmp_path / "arm.yaml").robot.urdf == "robot.urdf"
    excite.good("optimize", "arm.yaml", "-o", "arm.h5", *BRIEF)
    excite.good("check", "arm.yaml", "arm.h5")


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
    ask = ("init", "--urdf", "urdf/robot.urdf", "-o", "arm.yaml")
    words = excite.refused(*ask)
    assert f"asks for the package 'hand_description' in {package}" in words
    assert "--allow-found" in words
    assert not (tmp_path / "arm.yaml").exists()
    told = " ".join(excite.good(*ask, "--allow-found").stdout.split())
    assert f"allowed to read the package 'hand_description' in {package}" in told
    assert load_spec(tmp_path / "arm.yaml").robot.package_dirs == ("src/hand_description",)


@pytest.mark.long
@pytest.mark.parametrize(("answer", "status"), [("y", 0), ("n", 2)])
def test_a_terminal_is_asked(tmp_path: Path, cache: Path, answer: str, status: int) -> None:
    with_a_package(tmp_path)
    words = [*EXCITE, "init", "--urdf", "urdf/robot.urdf", "-o", "arm.yaml"]
    ended, said = seen_on_a_terminal(words, 200, tmp_path, environment(cache), f"{answer}\n")
    assert ended == status, said
    assert "outside its own folder. [y/N]" in said
    assert (tmp_path / "arm.yaml").exists() is (status == 0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), ("--robot NAME", "--urdf FILE")),  # without a terminal it does not hang
        (("--robot", "ur100"), ("Did you mean 'ur10'?",)),
        (("panda",), ("--robot panda",)),
        (("--robot", "iris_simple"), ("has no movable joint",)),
    ],
)
def test_what_is_no_robot_is_one_sentence(
    excite: Program, words: tuple[str, ...], told: tuple[str, ...]
) -> None:
    said = excite.refused("init", *words)
    assert all(each in said for each in told)
    assert said.count("error:") == 1
    assert list(excite.folder.iterdir()) == []


def test_a_cell_from_the_shell(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path)
    told = excite.good("init", "--urdf", "robot.urdf").stdout
    assert "floor: 0.04 m, the lowest point of what does not move (base)" in told
    words = ("init", "--urdf", "robot.urdf", "--overwrite", "--floor", "-0.8")
    boxes = ("--box", "table=1.2,0.8,0.7@1.2,0,-0.45", "--wall", "back=-0.9,0,0:1,0,0")
    excite.good(*words, *boxes, "--keep-out", "elbow=1.5,2")
    own = load_spec(tmp_path / "robot.yaml").constraints
    assert own.surroundings.floor == -0.8
    assert list(own.surroundings.boxes) == ["table"]
    assert list(own.surroundings.walls) == ["back"]
    assert own.keep_out["elbow"] == {"elbow": (1.5, 2.0)}
    assert "--box t=1: give NAME=LENGTHS@CENTRE" in excite.refused(*words, "--box", "t=1")


def test_floating_base_measures_its_wrench(excite: Program, tmp_path: Path) -> None:
    arm(tmp_path)
    excite.good("init", "--urdf", "robot.urdf", "--base", "floating")
    robot = load_spec(tmp_path / "robot.yaml").robot
    assert (robot.base, robot.rows) == ("floating", ("base", "joints"))


def test_what_init_writes_is_planned_and_checked(excite: Program, tmp_path: Path) -> None:
    with_gripper(tmp_path, shape(FINGERS.format("palm")))
    excite.good("init", "--urdf", "robot.urdf")
    assert len(load_spec(tmp_path / "robot.yaml").constraints.self_collision.without_shapes) == 2
    excite.good("optimize", "robot.yaml", "-o", "robot.h5", *BRIEF)
    checked = excite.good("check", "robot.yaml", "robot.h5")
    assert "NOT GUARDED: the meshes of palm, finger" in checked.stdout
