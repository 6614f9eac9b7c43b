"""Grippers whose fingers follow one joint, written by hand after public figures.

`HAND` is like the hand of a Panda: two fingers that slide apart, on a wrist of two joints. `CLAW`
is like a Robotiq 2F-85 as a tree: one knuckle drives five other joints, some the other way round,
some on top of joints that follow themselves, one with an offset.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.robot.model import Robot, build_robot
from tests.urdf_elements import box, joint, link, robot_text


def _link(
    name: str, mass: float, center: tuple[float, float, float], size: tuple[float, float, float]
) -> str:
    """A full box."""
    x, y, z = size
    m, place = mass / 12, _words(center)
    moments = _words((m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y)))
    return link(name, mass, moments, place, box(_words(size), place), turn="0.1 0.2 0.3")


def _words(values: tuple[float, ...]) -> str:
    return " ".join(map(str, values))


_WRIST_LIMITS = 'lower="-2" upper="2" velocity="2" effort="40"'
_WRIST = (
    _link("base", 3.0, (0, 0, 0.05), (0.1, 0.1, 0.1)),
    _link("upper", 2.0, (0, 0, 0.2), (0.06, 0.06, 0.3)),
    _link("palm", 0.8, (0.01, 0, 0.04), (0.05, 0.12, 0.06)),
    joint("shoulder", ("base", "upper"), "0 0 0.2", "0 1 0", _WRIST_LIMITS),
    joint("wrist", ("upper", "palm"), "0 0 0.45", "0 0 1", _WRIST_LIMITS),
)
_SLIDE = 'lower="0" upper="0.04" velocity="0.2" effort="20"'
HAND = (
    *_WRIST,
    _link("left_finger", 0.1, (0, 0.01, 0.03), (0.02, 0.01, 0.05)),
    _link("right_finger", 0.12, (0, -0.01, 0.03), (0.02, 0.01, 0.05)),
    joint("finger_1", ("palm", "left_finger"), "0 0.02 0.08", "0 1 0", _SLIDE, kind="prismatic"),
    joint("finger_2", ("palm", "right_finger"), "0 -0.02 0.08",
          "0 -1 0", _SLIDE, kind="prismatic", turn="0 0 0.2", more='<mimic joint="finger_1"/>'),
)  # fmt: skip


def _follows(joint: str, multiplier: float, offset: float = 0.0) -> str:
    return f'<mimic joint="{joint}" multiplier="{multiplier}" offset="{offset}"/>'


_OPEN = 'lower="0" upper="0.8" velocity="2" effort="30"'
_BACK = 'lower="-0.9" upper="0.9" velocity="2" effort="30"'
CLAW = (
    *_WRIST,
    *(
        _link(f"{side}_{part}", mass, (0.005, 0.0, 0.02), (0.02, 0.01, length))
        for side in ("left", "right")
        for part, mass, length in (
            ("outer", 0.05, 0.05), ("finger", 0.08, 0.04), ("inner", 0.04, 0.05),
        )
    ),
    joint("knuckle", ("palm", "left_outer"), "0.03 0 0.08", "0 1 0", _OPEN),
    joint("left_tip", ("left_outer", "left_finger"), "0.03 0 0.05", "0 1 0",
          _BACK, more=_follows("knuckle", -1.0)),
    joint("left_inner_joint", ("palm", "left_inner"), "0.012 0 0.1", "0 1 0",
          _BACK, more=_follows("knuckle", 1.0)),
    joint("right_knuckle", ("palm", "right_outer"), "-0.03 0 0.08", "0 1 0",
          _BACK, more=_follows("knuckle", -1.0)),
    joint("right_tip", ("right_outer", "right_finger"), "-0.03 0 0.05", "0 1 0",
          _BACK, more=_follows("right_knuckle", -0.9, 0.05)),
    joint("right_inner_joint", ("palm", "right_inner"), "-0.012 0 0.1", "0 1 0",
          _BACK, more=_follows("left_inner_joint", -1.0)),
)  # fmt: skip


def urdf_of(parts: tuple[str, ...]) -> str:
    """The text of a URDF."""
    return robot_text("coupled", *parts)


def coupled_robot(parts: tuple[str, ...], **spec: Any) -> Robot:
    """Built of `parts`, with all else that a config may say."""
    with TemporaryDirectory() as folder:
        return build_robot(RobotSpec(urdf=written(Path(folder), parts), **spec))


def written(folder: Path, parts: tuple[str, ...] = HAND) -> str:
    """The path of a URDF."""
    path = folder / "coupled.urdf"
    path.write_text(urdf_of(parts))
    return str(path)
