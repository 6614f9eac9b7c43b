"""The joints and links of one robot, with their limits."""

from dataclasses import dataclass
from typing import Literal

from excite_cli.robot.model import Robot, links_by_joint
from excite_cli.shown.record import Shown


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
