"""The cell that a robot stands in, as given at a shell: floor, boxes, walls, joint regions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from excite_cli.config.load_spec import parsed_spec
from excite_cli.errors import ConfigError

Tree = dict[str, Any]

NO_FLOOR = "none"
_FLOOR = "HEIGHT in the world [m], as 0.0, or none for a robot that hangs or is bolted to a wall"
_BOX = "NAME=LENGTHS@CENTRE [m], as table=1.2,0.8,0.7@0.9,0,0.35"
_WALL = "NAME=POINT:NORMAL, the normal towards the robot, as back=-0.5,0,0:1,0,0"
_REGION = "JOINT=FROM,TO [rad or m], as elbow_joint=2.5,3.1"


@dataclass(frozen=True)
class Cell:
    """What is said of the cell: floor, a height [m] or `none`; the others as the options say them.

    `boxes`: NAME=LENGTHS@CENTRE; `walls`: NAME=POINT:NORMAL; `keep_out`: JOINT=FROM,TO.
    """

    floor: str | float | None = None
    boxes: tuple[str, ...] = ()
    walls: tuple[str, ...] = ()
    keep_out: tuple[str, ...] = ()

    @property
    def said(self) -> bool:
        """Whether anything is."""
        return self.floor is not None or bool(self.boxes or self.walls or self.keep_out)


def put_cell(cell: Cell, tree: Tree) -> None:
    """Add it to a config's `constraints`.

    Raises
    ------
    ConfigError
        A text cannot be read, a name is given twice, or a value is not allowed.
    """
    around: Tree = {}
    if cell.floor not in (None, NO_FLOOR):
        where = f"--floor {cell.floor}"
        (around["floor"],) = _numbers(str(cell.floor), 1, where, _FLOOR)
    if cell.boxes:
        around["boxes"] = _by_name("--box", cell.boxes, _box)
    if cell.walls:
        around["walls"] = _by_name("--wall", cell.walls, _wall)
    if around:
        tree["constraints"]["surroundings"] = around
    if cell.keep_out:
        regions = _by_name("--keep-out", cell.keep_out, _region)
        tree["constraints"]["keep_out"] = {name: {name: ends} for name, ends in regions.items()}
    if cell.said:
        parsed_spec(tree, "--floor, --box, --wall, --keep-out")


def _by_name(option: str, texts: Sequence[str], read: Callable[[str, str], Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for text in texts:
        name, _, words = text.partition("=")
        value = read(words if name.strip() else "", f"{option} {text}")
        if name.strip() in found:
            raise ConfigError(f"{option} {text}: {name} is given twice; each needs its own name.")
        found[name.strip()] = value
    return found


def _box(words: str, where: str) -> Tree:
    size, _, position = words.partition("@")
    return {
        "size": _numbers(size, 3, where, _BOX),
        "position": _numbers(position, 3, where, _BOX),
    }


def _wall(words: str, where: str) -> Tree:
    point, _, normal = words.partition(":")
    return {
        "point": _numbers(point, 3, where, _WALL),
        "normal": _numbers(normal, 3, where, _WALL),
    }


def _region(words: str, where: str) -> list[float]:
    return _numbers(words, 2, where, _REGION)


def _numbers(words: str, count: int, where: str, allowed: str) -> list[float]:
    """`count` numbers, separated by commas."""
    try:
        found = [float(word) for word in words.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise ConfigError(f"{where}: give {allowed}.")
    return found
