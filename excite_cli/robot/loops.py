"""Closed kinematic loops, which a URDF cannot hold, and joints that follow others.

A URDF is a tree. What closes a loop stands beside it: <loop_joint> with <link1> and <link2> (Drake;
our own writing of MuJoCo's <equality> connect and weld), or a <joint> within <gazebo>. The tree is
the robot with every loop cut there; the joints of a loop then move on their own, which those of the
real robot do not.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import RobotError, nearest

TAG = "loop_joint"
_FIXED = "fixed"


@dataclass(frozen=True)
class Loop:
    """A loop that is cut between two links; `joints` of the tree that lie on it and can move."""

    links: tuple[str, str]
    joints: tuple[str, ...]


def closed_loops(root: ElementTree.Element) -> tuple[Loop, ...]:
    """The loops of a URDF that is a tree."""
    above = {}
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            above[child.get("link", "")] = (joint, parent.get("link", ""))
    cuts = [_ends(each, "link1", "link2") for each in root.findall(TAG)]
    cuts += [_ends(each, "parent", "child") for each in root.findall("gazebo/joint")]
    found = []
    for first, second in cuts:
        ways = [_to_root(link, above) for link in (first, second)]
        on_loop = {id(joint) for joint in ways[0]} ^ {id(joint) for joint in ways[1]}
        joints = [
            joint.get("name", "")
            for joint in root.findall("joint")
            if id(joint) in on_loop and joint.get("type") != _FIXED
        ]
        if joints:
            found.append(Loop((first, second), tuple(joints)))
    return tuple(found)


def loops_in_words(loops: Sequence[Loop]) -> tuple[str, ...]:
    """What is done about the loops and what can be, in a sentence; none without loops."""
    if not loops:
        return ()
    cut = ", ".join(" and ".join(loop.links) for loop in loops)
    joints = ", ".join(dict.fromkeys(joint for loop in loops for joint in loop.joints))
    count = "a closed loop is" if len(loops) == 1 else f"{len(loops)} closed loops are"
    return (
        f"{count} cut between {cut}: in the model, {joints} move on their own. Closed loops are "
        "not modelled: leave these joints locked (robot.posture says where), or, where one of them "
        "drives the others in proportion (a parallelogram), give these <mimic> and move that one",
    )


def _ends(element: ElementTree.Element, first: str, second: str) -> tuple[str, str]:
    """Names of the links at both ends; as attributes, or as text within <gazebo>."""
    ends = []
    for tag in (first, second):
        end = element.find(tag)
        text = "" if end is None else (end.get("link") or end.text or "")
        ends.append(text.strip().split("::")[-1])
    return ends[0], ends[1]


def _to_root(
    link: str, above: dict[str, tuple[ElementTree.Element, str]]
) -> list[ElementTree.Element]:
    """Joints between a link and the root."""
    joints = []
    while link in above:
        joint, link = above[link]
        joints.append(joint)
    return joints


# Joints that a URDF lets follow others: <mimic joint="…" multiplier="…" offset="…"/>.
#
# A joint may follow one that follows another; what is told here is the joint at the end of the
# chain,
#
#     q = multiplier · q_driver + offset.

_STILL = "fixed"


@dataclass(frozen=True)
class Mimic:
    """What a joint follows: a joint that moves on its own."""

    driver: str
    multiplier: float
    offset: float

    def position(self, driver: float) -> float:
        """Of the joint that follows, at a position of its driver [rad or m]."""
        return self.multiplier * driver + self.offset


def mimics(path: Path, root: ElementTree.Element) -> dict[str, Mimic]:
    """All joints of a URDF that follow others, with the joint that moves them in the end.

    That may be one that the URDF does not have (`lost`).

    Raises
    ------
    RobotError
        A joint follows itself, or others in a circle.
    """
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    direct = {
        name: Mimic(
            mimic.get("joint", ""),
            float(mimic.get("multiplier", 1.0)),
            float(mimic.get("offset", 0.0)),
        )
        for name, joint in joints.items()
        for mimic in joint.findall("mimic")
        if joint.get("type") != _STILL
    }
    return {name: _in_the_end(path, name, direct) for name in direct}


def lost(followers: Mapping[str, Mimic], root: ElementTree.Element) -> tuple[str, ...]:
    """Sentences on joints that follow what the URDF does not have."""
    known = [joint.get("name", "") for joint in root.findall("joint")]
    return tuple(
        f"'{name}' mimics '{own.driver}', which is no joint of the URDF: the joint is locked."
        f"{nearest(own.driver, known)}"
        for name, own in followers.items()
        if own.driver not in known
    )


def _in_the_end(path: Path, name: str, direct: dict[str, Mimic]) -> Mimic:
    found, seen = direct[name], [name]
    while found.driver in direct:
        if found.driver in seen:
            circle = " → ".join([*seen, found.driver])
            raise RobotError(
                f"{path}: joints mimic each other in a circle ({circle}), so none of them moves on "
                "its own. Remove one <mimic>."
            )
        seen.append(found.driver)
        above = direct[found.driver]
        found = Mimic(
            above.driver,
            found.multiplier * above.multiplier,
            found.multiplier * above.offset + found.offset,
        )
    return found
