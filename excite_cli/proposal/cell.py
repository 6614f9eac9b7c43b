"""The cell that a robot stands in: as given at a shell, and its floor where none is given."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from excite_cli.config.load_spec import parsed_spec
from excite_cli.errors import ConfigError
from excite_cli.geometry.link_meshes import Poses, link_meshes
from excite_cli.robot.link_frame import MovedBodies
from excite_cli.robot.model import Array, Robot

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


# Where the floor of a robot is of which only the URDF is known: under what does not move.
#
# What stands, rises from what carries it; what hangs or is bolted to a wall does not. With c_l(q)
# the centre of mass [m] of limb l (all that one of the first joints carries), m_l its mass [kg]
# and o the middle [m] of the box around the shapes that do not move,
#
#     d_l = mean over postures q of c_l(q) − o,    d = Σ m_l d_l / Σ m_l        (3,) [m]
#
# a robot stands if every limb rises (d_l,z > 0) and all together rise more than they lean out:
# d_z > |(d_x, d_y)|, that is, steeper than 45°. The ratio d_z / |(d_x, d_y)| of robots that stand
# was 1.9 or more, of the same ones bolted to walls 0.2 or less (docs/decisions/a-floor-by-
# default.md).

# Postures of the mean: as many as `geometry/obstacle_pairs.py` asks what meets what.
_POSTURES, _SEED = 300, 0
_LEVEL, _DIGITS = 1e-3, 3  # [m] a floor is level to a millimetre at best


@dataclass(frozen=True)
class Floor:
    """`height` [m] in the world, None where the robot does not stand on one, and why, in words."""

    height: float | None
    words: str


def floor_below(robot: Robot) -> Floor:
    """The lowest point of what does not move, at the robot's posture; 0 if it has no shapes.

    None for a robot that hangs or leans out from a wall, and where nothing rises above the plane.

    Raises
    ------
    RobotError
        A mesh cannot be used.
    """
    moved, here = MovedBodies(robot), Poses.of(robot, robot.posture[None])
    poses = Poses.of(robot, robot.draw_states(_POSTURES, _SEED)[0])
    carried: dict[int, list[Array]] = {}
    still: dict[str, Array] = {}
    for mesh in link_meshes(robot):
        if len(moved.moving(mesh.joint)):
            carried.setdefault(mesh.joint, []).append(mesh.hull)
        else:
            still[mesh.link] = here.points(mesh.joint, mesh.hull)[0]
    # Without shapes the robot is bolted down where the world has its origin.
    points = np.vstack([*still.values()]) if still else np.zeros((1, 3))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    if not _stands(robot, moved, poses, middle):
        words = "what moves does not rise from what carries it, so the robot hangs or is bolted to"
        return Floor(None, f"{words} a wall; --floor HEIGHT gives one")
    height, where = 0.0, "the plane of the world's origin, since what does not move has no shapes"
    if still:
        height = round(float(points[:, 2].min()), _DIGITS) + 0.0  # no -0.0
        lowest = min(still, key=lambda link: float(still[link][:, 2].min()))
        where = f"the lowest point of what does not move ({lowest})"
    rises = [  # how far the shapes on a joint can all be above the plane [m]
        float(poses.points(joint, np.vstack(hulls))[:, :, 2].min(axis=1).max()) - height
        for joint, hulls in carried.items()
    ]
    # Shapes of a first link may reach below it all the time; those of all that moves may not.
    if max(rises, default=1.0) < _LEVEL:
        return Floor(None, f"nothing that moves rises above {where}; --floor HEIGHT gives one")
    return Floor(height, f"{where}; --floor HEIGHT for another, --floor none for none")


def _stands(robot: Robot, moved: MovedBodies, poses: Poses, middle: Array) -> bool:
    """Whether every limb rises from `middle` (3,) [m], and all together more than they lean."""
    model = robot.model
    first: dict[int, int] = {}  # of every joint that moves, the first one of its limb
    moments: dict[int, Array] = {}
    masses: dict[int, float] = {}
    for joint in range(1, model.njoints):
        if not len(moved.moving(joint)):
            continue
        limb = first[joint] = first.get(int(model.parents[joint]), joint)
        inertia = model.inertias[joint]
        centre = poses.points(joint, np.array(inertia.lever)).mean(axis=0)
        moments[limb] = moments.get(limb, np.zeros(3)) + inertia.mass * (centre - middle)
        masses[limb] = masses.get(limb, 0.0) + inertia.mass
    limbs = [moments[limb] for limb in moments if masses[limb] > 0]
    total = np.sum(limbs, axis=0) if limbs else np.zeros(3)
    rises = all(moment[2] > 0 for moment in limbs)
    return rises and bool(total[2] > np.hypot(total[0], total[1]))
