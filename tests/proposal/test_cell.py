"""Floor, boxes, walls and regions of joints as options, and what is wrong with them."""

from pathlib import Path

import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import ConfigError
from excite_cli.proposal.cell import Cell
from excite_cli.proposal.propose import Request, propose
from tests.proposal.robots import arm


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
