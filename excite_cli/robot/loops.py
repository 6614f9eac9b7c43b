"""Closed kinematic loops, which a URDF cannot hold: where they are cut, and what lies on them.

A URDF is a tree. What closes a loop stands beside it: <loop_joint> with <link1> and <link2> (Drake;
our own writing of MuJoCo's <equality> connect and weld), or a <joint> within <gazebo>. The tree is
the robot with every loop cut there; the joints of a loop then move on their own, which those of the
real robot do not.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass

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
