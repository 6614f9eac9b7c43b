"""Floor, boxes, walls and regions of joints as options, and what is wrong with them."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.start import clear_posture
from excite_cli.excitation.task import MotionTask
from excite_cli.proposal.cell import Cell, floor_below
from excite_cli.proposal.propose import Request, propose
from excite_cli.robot.description import EXAMPLE_PREFIX
from excite_cli.robot.model import build_robot
from tests.proposal.robots import GOOD, arm, link, serial


def test_a_cell_is_written(tmp_path: Path) -> None:
    arm(tmp_path)
    cell = Cell(
        "-0.8",
        ("table=1.2,0.8,0.7@1.2,0,-0.45",),
        ("back=-0.9,0,0:1,0,0", "side=0,-2,0:0,1,0"),
        ("elbow=1.5,2",),
    )
    own = parse_spec(propose(Request("robot.urdf", tmp_path, cell=cell)).text).constraints
    around = own.surroundings
    assert around is not None
    assert around.floor == -0.8
    assert around.boxes["table"].size == (1.2, 0.8, 0.7)
    assert around.boxes["table"].position == (1.2, 0, -0.45)
    assert around.walls["back"].point == (-0.9, 0, 0)
    assert around.walls["side"].normal == (0, 1, 0)
    assert own.keep_out == {"elbow": {"elbow": (1.5, 2)}}


def test_a_box_alone_stands_beside_the_floor_of_the_robot(tmp_path: Path) -> None:
    arm(tmp_path)
    cell = Cell(boxes=("table=0.1,0.1,0.1@1.2,0,0.1",))
    around = parse_spec(propose(Request("robot.urdf", tmp_path, cell=cell)).text).constraints
    assert around.surroundings is not None
    assert around.surroundings.floor == pytest.approx(0.04)
    assert list(around.surroundings.boxes) == ["table"]


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        (
            Cell("low"),
            r"^--floor low: give HEIGHT in the world \[m\], as 0\.0, or none for a",
        ),
        (Cell("1,2"), r"^--floor 1,2: give HEIGHT"),
        (Cell("nan"), r"constraints\.surroundings\.floor: allowed: a finite number"),
        (Cell(boxes=("t=1,1@0,0,1",)), r"^--box t=1,1@0,0,1: give NAME=LENGTHS@CENTRE \[m\], as"),
        (Cell(boxes=("1,1,1@0,0,1",)), r"^--box 1,1,1@0,0,1: give NAME=LENGTHS@CENTRE"),
        (Cell(boxes=("=1,1,1@0,0,1",)), r"^--box =1,1,1@0,0,1: give NAME=LENGTHS@CENTRE"),
        (Cell(boxes=("t=1,0,1@0,0,1",)), r"^--floor, --box, --wall, --keep-out: .*boxes\.t\.size"),
        (Cell(boxes=("t=1,1,1@2,0,1",) * 2), r"^--box t=.*: t is given twice; each needs its own"),
        (Cell(walls=("w=1,1,1",)), r"^--wall w=1,1,1: give NAME=POINT:NORMAL, the normal towards"),
        (Cell(walls=("w=1,1,1:0,0,0",)), "a normal of zeros has no direction"),
        (Cell(keep_out=("elbow=1",)), r"^--keep-out elbow=1: give JOINT=FROM,TO \[rad or m\], as"),
        (Cell(keep_out=("elbow=2,1",)), r"keep_out: elbow\.elbow: 2 is not below 1"),
        (Cell(keep_out=("ellbow=1,2",)), r"no joint 'ellbow'. Did you mean 'elbow'\?"),
        (Cell("0.04", walls=("floor=1,1,1:0,0,1",)), "named twice: floor"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, cell: Cell, words: str) -> None:
    arm(tmp_path)
    with pytest.raises(ConfigError, match=words):
        propose(Request("robot.urdf", tmp_path, cell=cell))


MOUNTED = {
    "stands": ("0 0 0", 0.84),  # 0.04 is the lowest point of the base's box, 0.8 its pedestal
    "hangs": (f"{np.pi} 0 0", None),
    "wall": (f"0 {np.pi / 2} 0", None),
    "other wall": (f"0 {-np.pi / 2} 0", None),
    "side": (f"{np.pi / 2} 0 0", None),
}


def mounted(folder: Path, rpy: str) -> Path:
    """A turning arm whose base is fixed to the world 0.8 m up, turned by `rpy`."""
    mount = (
        '<joint name="mount" type="fixed"><parent link="world"/><child link="base"/>'
        f'<origin xyz="0 0 0.8" rpy="{rpy}"/></joint>'
    )
    turn = (
        '<joint name="turn" type="revolute"><parent link="base"/><child link="post"/>'
        '<origin xyz="0 0 0.25"/><axis xyz="0 0 1"/>'
        '<limit lower="-3" upper="3" velocity="3" effort="50"/></joint>'
    )
    names = "base turn post shoulder upper elbow lower"
    return serial(folder, names, '<link name="world"/>', mount, turn=turn)


@pytest.mark.parametrize("how", MOUNTED)
def test_a_robot_that_rises_stands(tmp_path: Path, how: str) -> None:
    rpy, height = MOUNTED[how]
    mounted(tmp_path, rpy)
    found = propose(Request("robot.urdf", tmp_path))
    around = parse_spec(found.text).constraints.surroundings
    if height is None:
        assert around is None
        assert any("the robot hangs or is bolted to a wall" in note for note in found.notes)
        assert "no floor: what moves does not rise" in " ".join(found.text.split())
        return
    assert around is not None
    assert around.floor == pytest.approx(height)
    assert "the lowest point of what does not move (base)" in " ".join(
        found.text.replace("#", "").split()
    )
    assert any(note.startswith("floor: 0.84 m") for note in found.notes)


def test_every_limb_must_rise(tmp_path: Path) -> None:
    """A leg below a pelvis is no arm above a base, even if it can be raised and weighs little."""
    leg = (
        '<joint name="hip" type="revolute"><parent link="base"/><child link="leg"/>'
        '<origin xyz="0 0 0.1" rpy="3.14159 0 0"/><axis xyz="0 1 0"/>'
        '<limit lower="-2.5" upper="2.5" velocity="3" effort="50"/></joint>'
    )
    names, more = "base shoulder upper elbow lower", (leg, link("leg"))
    serial(tmp_path, names, *more, upper=link("upper", 9.0))
    assert (
        parse_spec(propose(Request("robot.urdf", tmp_path)).text).constraints.surroundings is None
    )
    # A leg that stays where it is carries the robot, and its foot is the lowest point.
    found = propose(Request("robot.urdf", tmp_path, ("shoulder", "elbow")))
    around = parse_spec(found.text).constraints.surroundings
    assert around is not None
    assert around.floor == pytest.approx(-0.1, abs=1e-3)


def test_without_shapes_below_the_floor_is_the_plane_of_the_world(tmp_path: Path) -> None:
    serial(tmp_path, "base shoulder upper elbow lower", base=link("base", shape=""))
    robot = build_robot(RobotSpec(urdf="robot.urdf"), tmp_path)
    floor = floor_below(robot)
    assert floor.height == 0.0
    assert "has no shapes" in floor.words
    # Nothing can be kept above a floor without any, and links that are not to be looked at are not.
    bare = {name: link(name, shape="") for name in ("base", "upper", "lower")}
    serial(tmp_path, "base shoulder upper elbow lower", **bare)
    found = propose(Request("robot.urdf", tmp_path))
    assert any("no floor: no shapes are looked at" in note for note in found.notes)
    arm(tmp_path)
    off = propose(Request("robot.urdf", tmp_path, overrides=("constraints.self_collision=null",)))
    assert "surroundings" not in off.settled.tree["constraints"]


def test_a_link_that_never_rises_above_it_stands_on_no_floor(tmp_path: Path) -> None:
    """A hinge in the plane of the world's origin, whose link reaches 0.1 m through it."""
    through = (
        '<collision><geometry><box size="0.1 0.1 0.2"/></geometry></collision>'
        '<collision><origin xyz="0 0 0.9"/><geometry><box size="0.1 0.1 1"/></geometry></collision>'
    )
    hinge = (
        '<joint name="hinge" type="revolute"><parent link="base"/><child link="door"/>'
        f'<axis xyz="0 0 1"/><limit {GOOD}/></joint>'
    )
    base = link("base", shape="")
    serial(tmp_path, "base hinge door", base=base, hinge=hinge, door=link("door", shape=through))
    found = propose(Request("robot.urdf", tmp_path))
    assert parse_spec(found.text).constraints.surroundings is None
    assert any(note.startswith("no floor: nothing that moves rises above") for note in found.notes)


def test_a_floating_base_gets_no_floor(tmp_path: Path) -> None:
    arm(tmp_path)
    found = propose(Request("robot.urdf", tmp_path, base="floating"))
    assert parse_spec(found.text).constraints.surroundings is None
    assert not any("floor" in note for note in found.notes)


def test_what_is_given_stands(tmp_path: Path) -> None:
    arm(tmp_path)
    for cell, overrides, floor in (
        (Cell("-0.3"), (), -0.3),
        (Cell("none"), (), None),
        (Cell(), ("constraints.surroundings.floor=-0.2",), -0.2),
        (Cell(), ("constraints.surroundings=null",), None),
    ):
        request = Request("robot.urdf", tmp_path, overrides=overrides, cell=cell)
        around = parse_spec(propose(request).text).constraints.surroundings
        assert (around and around.floor) == floor


def test_the_posture_of_an_arm_is_moved_above_its_floor(tmp_path: Path) -> None:
    """That of UR10's zero angles and a bent elbow lies below its base."""
    found = propose(Request(f"{EXAMPLE_PREFIX}ur10", tmp_path))
    problem = build_problem(parse_spec(found.text), tmp_path)
    assert clear_posture(MotionTask(problem), 1).as_configured
    (floor,) = (each for each in problem.constraints if isinstance(each, Surroundings))
    # The shoulder turns above the floor, which its fat capsule all but touches.
    assert [(pair.first, pair.reason.why.value) for pair in floor.pairs.dropped] == [
        ("shoulder_link", "always_near")
    ]


def test_a_floor_that_leaves_no_posture_says_what_to_do(tmp_path: Path) -> None:
    mounted(tmp_path, "0 0 0")
    floor = Request("robot.urdf", tmp_path, cell=Cell("1.6"))
    words = (
        r"^No posture of the robot is clear of what stands around it: too near in the best of 40 "
        r"are .*upper – floor.*\. Give a lower --floor HEIGHT, or --floor none for a robot that "
        r"hangs or is bolted to a wall\.$"
    )
    with pytest.raises(NoAdmissibleMotionError, match=words):
        propose(floor)
    box = Request("robot.urdf", tmp_path, cell=Cell(boxes=("crate=2,2,2@0,0,1.9",)))
    with pytest.raises(NoAdmissibleMotionError, match=r"another place for crate \(--box, --wall\)"):
        propose(box)
