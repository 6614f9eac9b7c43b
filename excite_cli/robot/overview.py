"""A robot at a glance, from its URDF's XML alone: what it is, how many joints, what is there.

The kind is read from the names of joints and links and from the longest chain of joints; it is a
help to choose by, and nothing is computed from it.
"""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from excite_cli.robot.description import example_robots
from excite_cli.robot.model import Robot, links_by_joint
from excite_cli.shown.answer import Shown

# The joints and links of one robot, with their limits.


@dataclass(frozen=True)
class DescribedJoint:
    """A joint with its limits [rad, rad/s, N·m; prismatic: m, m/s, N] and the links it carries.

    `followers` are joints that move with it (mimic); `links` contain those that they carry.
    """

    name: str
    kind: Literal["revolute", "prismatic"]
    lower: float
    upper: float
    velocity: float
    effort: float
    links: tuple[str, ...]
    followers: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class DescribedRobot(Shown):
    """All moved joints, and the links that are fixed to the base."""

    name: str
    joints: tuple[DescribedJoint, ...]
    base_links: tuple[str, ...]


def describe(robot: Robot) -> DescribedRobot:
    """What a person must know of a robot to write its config."""
    limits, links = robot.limits, links_by_joint(robot)
    followers = robot.followers
    joints = tuple(
        DescribedJoint(
            name,
            "prismatic" if robot.sliding[j] else "revolute",
            float(limits.lower[j]),
            float(limits.upper[j]),
            float(limits.velocity[j]),
            float(limits.effort[j]),
            tuple(link for each in (name, *followers[j]) for link in links.get(each, [])),
            followers[j],
        )
        for j, name in enumerate(robot.joint_names)
    )
    return DescribedRobot(robot.name, joints, tuple(links.get("", [])))


_MOVING = ("revolute", "continuous", "prismatic")
_KNEE = re.compile(r"knee|kfe|calf|lower_leg|leg_(left|right)_4")
_ARM = re.compile(r"arm|shoulder|elbow|wrist")
_WHEEL = re.compile(r"wheel|caster")
_ROTOR = re.compile(r"rotor|propeller|quadrotor|hextilt|borinot|iris")
_FEWEST_OF_AN_ARM = 5


@dataclass(frozen=True)
class Glance:
    """What the URDF at `path` describes; `others` are more names of the same file."""

    name: str
    others: tuple[str, ...]
    path: Path
    kind: str
    joints: int
    inertias: bool
    visual: bool
    collision: bool


def known_robots() -> list[Glance]:
    """All robots of example-robot-data, each file once, by name.

    Raises
    ------
    RobotError
        The package is not installed.
    """
    names: dict[Path, list[str]] = {}
    for name, path in example_robots().items():
        names.setdefault(path, []).append(name)
    found = []
    for path, given in names.items():
        first, *others = sorted(given, key=lambda name: (len(name), name))
        found.append(glance(first, path, tuple(others)))
    return sorted(found, key=lambda each: each.name.lower())


def glance(name: str, path: Path, others: tuple[str, ...] = ()) -> Glance:
    """Read the URDF at `path`, which must be XML."""
    root = ElementTree.parse(path).getroot()
    moving = [
        joint
        for joint in root.findall("joint")
        if joint.get("type") in _MOVING and joint.find("mimic") is None
    ]
    return Glance(
        name=name,
        others=others,
        path=path,
        kind=_kind(path, root, moving),
        joints=len(moving),
        inertias=root.find("link/inertial/inertia") is not None,
        visual=root.find("link/visual") is not None,
        collision=root.find("link/collision") is not None,
    )


def _kind(path: Path, root: ElementTree.Element, moving: list[ElementTree.Element]) -> str:
    joints = [str(joint.get("name", "")).lower() for joint in moving]
    links = [str(link.get("name", "")).lower() for link in root.findall("link")]
    names = [*joints, *links, path.stem.lower()]
    knees = sum(bool(_KNEE.search(name)) for name in joints)
    arms = any(_ARM.search(name) for name in joints)
    chain = _longest_chain(root, {str(joint.get("name")) for joint in moving})
    if knees >= 4:
        return "quadruped with arm" if chain >= _FEWEST_OF_AN_ARM else "quadruped"
    if knees >= 1:
        return "humanoid" if arms else "biped"
    if any(_ROTOR.search(name) for name in names):
        return "flying"
    if "hand" in str(path.parent.parent.name) and not arms:
        return "hand"
    if any(_WHEEL.search(name) for name in names):
        return "mobile, with arms" if chain >= _FEWEST_OF_AN_ARM else "mobile"
    if chain >= _FEWEST_OF_AN_ARM:
        both = any("left" in name for name in joints) and any("right" in name for name in joints)
        return "two arms" if both else "arm"
    return "other"


def _longest_chain(root: ElementTree.Element, moving: set[str]) -> int:
    """The most moving joints between the root and any link."""
    above: dict[str, tuple[str, bool]] = {}
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            moves = joint.get("name") in moving
            above[str(child.get("link"))] = (str(parent.get("link")), moves)
    longest = 0
    for link in above:
        count, seen = 0, set()
        while link in above and link not in seen:
            seen.add(link)
            link, moves = above[link]
            count += moves
        longest = max(longest, count)
    return longest
