"""Grippers whose fingers follow one joint, written by hand after public figures.

`HAND` is like the hand of a Panda: two fingers that slide apart, on a wrist of two joints. `CLAW`
is like a Robotiq 2F-85 as a tree: one knuckle drives five other joints, some the other way round,
some on top of joints that follow themselves, one with an offset.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.robot.model import Robot, build_robot


@dataclass(frozen=True)
class _Link:
    name: str
    mass: float
    center: tuple[float, float, float]
    box: tuple[float, float, float]

    def xml(self) -> str:
        x, y, z = self.box
        m = self.mass / 12
        place = f'<origin xyz="{_words(self.center)}" rpy="0.1 0.2 0.3"/>'
        moments = f'ixx="{m * (y * y + z * z)}" iyy="{m * (x * x + z * z)}" ' \
                  f'izz="{m * (x * x + y * y)}"'  # fmt: skip
        shape = f'<origin xyz="{_words(self.center)}"/><geometry><box size="{_words(self.box)}"/>'
        return (
            f'<link name="{self.name}"><inertial>{place}<mass value="{self.mass}"/>'
            f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial>'
            f"<collision>{shape}</geometry></collision></link>"
        )


@dataclass(frozen=True)
class _Joint:
    name: str
    kind: str
    parent: str
    child: str
    place: str
    axis: str
    limits: str
    mimic: str = ""

    def xml(self) -> str:
        return (
            f'<joint name="{self.name}" type="{self.kind}"><origin {self.place}/>'
            f'<parent link="{self.parent}"/><child link="{self.child}"/><axis xyz="{self.axis}"/>'
            f"<limit {self.limits}/>{self.mimic}</joint>"
        )


_WRIST_LIMITS = 'lower="-2" upper="2" velocity="2" effort="40"'
_WRIST = (
    _Link("base", 3.0, (0, 0, 0.05), (0.1, 0.1, 0.1)),
    _Link("upper", 2.0, (0, 0, 0.2), (0.06, 0.06, 0.3)),
    _Link("palm", 0.8, (0.01, 0, 0.04), (0.05, 0.12, 0.06)),
    _Joint("shoulder", "revolute", "base", "upper", 'xyz="0 0 0.2"', "0 1 0", _WRIST_LIMITS),
    _Joint("wrist", "revolute", "upper", "palm", 'xyz="0 0 0.45"', "0 0 1", _WRIST_LIMITS),
)
_SLIDE = 'lower="0" upper="0.04" velocity="0.2" effort="20"'
HAND = (
    *_WRIST,
    _Link("left_finger", 0.1, (0, 0.01, 0.03), (0.02, 0.01, 0.05)),
    _Link("right_finger", 0.12, (0, -0.01, 0.03), (0.02, 0.01, 0.05)),
    _Joint("finger_1", "prismatic", "palm", "left_finger", 'xyz="0 0.02 0.08"', "0 1 0", _SLIDE),
    _Joint("finger_2", "prismatic", "palm", "right_finger", 'xyz="0 -0.02 0.08" rpy="0 0 0.2"',
           "0 -1 0", _SLIDE, '<mimic joint="finger_1"/>'),
)  # fmt: skip


def _follows(joint: str, multiplier: float, offset: float = 0.0) -> str:
    return f'<mimic joint="{joint}" multiplier="{multiplier}" offset="{offset}"/>'


_OPEN = 'lower="0" upper="0.8" velocity="2" effort="30"'
_BACK = 'lower="-0.9" upper="0.9" velocity="2" effort="30"'
CLAW = (
    *_WRIST,
    *(
        _Link(f"{side}_{part}", mass, (0.005, 0.0, 0.02), (0.02, 0.01, length))
        for side in ("left", "right")
        for part, mass, length in (
            ("outer", 0.05, 0.05), ("finger", 0.08, 0.04), ("inner", 0.04, 0.05),
        )
    ),
    _Joint("knuckle", "revolute", "palm", "left_outer", 'xyz="0.03 0 0.08"', "0 1 0", _OPEN),
    _Joint("left_tip", "revolute", "left_outer", "left_finger", 'xyz="0.03 0 0.05"', "0 1 0",
           _BACK, _follows("knuckle", -1.0)),
    _Joint("left_inner_joint", "revolute", "palm", "left_inner", 'xyz="0.012 0 0.1"', "0 1 0",
           _BACK, _follows("knuckle", 1.0)),
    _Joint("right_knuckle", "revolute", "palm", "right_outer", 'xyz="-0.03 0 0.08"', "0 1 0",
           _BACK, _follows("knuckle", -1.0)),
    _Joint("right_tip", "revolute", "right_outer", "right_finger", 'xyz="-0.03 0 0.05"', "0 1 0",
           _BACK, _follows("right_knuckle", -0.9, 0.05)),
    _Joint("right_inner_joint", "revolute", "palm", "right_inner", 'xyz="-0.012 0 0.1"', "0 1 0",
           _BACK, _follows("left_inner_joint", -1.0)),
)  # fmt: skip


def urdf_of(parts: tuple[_Link | _Joint, ...]) -> str:
    """The text of a URDF."""
    return f'<robot name="coupled">{"".join(part.xml() for part in parts)}</robot>'


def coupled_robot(parts: tuple[_Link | _Joint, ...], **spec: Any) -> Robot:
    """Built of `parts`, with all else that a config may say."""
    with TemporaryDirectory() as folder:
        return build_robot(RobotSpec(urdf=written(Path(folder), parts), **spec))


def written(folder: Path, parts: tuple[_Link | _Joint, ...] = HAND) -> str:
    """The path of a URDF."""
    path = folder / "coupled.urdf"
    path.write_text(urdf_of(parts))
    return str(path)


def _words(values: tuple[float, ...]) -> str:
    return " ".join(map(str, values))
