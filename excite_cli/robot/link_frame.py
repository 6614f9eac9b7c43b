"""A link by its name: the moved joint that carries it, and its frame; which joints carry what."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.model import Array, Robot

# Which joints carry which bodies, and which move two bodies against each other.


def carried_bodies(robot: Robot) -> Array:
    """(njoints, m) of 0 and 1: does joint k of `robot.tree` carry what hangs on a model's joint?"""
    model, first = robot.model, robot.first_joint
    carried = np.zeros((model.njoints, robot.tree.n))
    for joint in range(1, model.njoints):
        carried[joint] = carried[model.parents[joint]]
        if joint >= first:
            carried[joint, joint - first] = 1.0
    return carried


class MovedBodies:
    """Which moved joints (n,) move a body, by themselves or by the joints that follow them."""

    def __init__(self, robot: Robot) -> None:
        self._carried = carried_bodies(robot)
        self._coupling = robot.coupling

    def moving(self, joint: int) -> NDArray[np.intp]:
        """Those that move what hangs on a joint of the model."""
        return self._own(self._carried[joint])

    def between(self, first: int, second: int) -> NDArray[np.intp]:
        """Those that move what hangs on two joints of the model against each other."""
        return self._own(np.abs(self._carried[first] - self._carried[second]))

    def _own(self, chosen: Array) -> NDArray[np.intp]:
        if self._coupling is not None:
            chosen = chosen @ np.abs(self._coupling.matrix)
        return np.flatnonzero(chosen)


@dataclass(frozen=True, eq=False)
class LinkFrame:
    """Link `name` is carried by the moved `joint`, in whose frame it stands at a placement.

    `rotation` (3, 3) and `translation` (3,) [m]: p_joint = rotation p_link + translation.
    """

    name: str
    joint: int
    rotation: Array
    translation: Array

    def point(self, of_joint: Array) -> Array:
        """The same point, (3,) in the joint's frame, in the link's."""
        return np.asarray(self.rotation.T @ (of_joint - self.translation))


def link_frame(robot: Robot, link: str, where: str) -> LinkFrame:
    """The link that `where` names.

    Raises
    ------
    ConfigError
        There is none, or it is fixed to what does not move.
    """
    frames = _links(robot)
    if link not in frames:
        raise ConfigError(
            f"{where}: the robot has no link '{link}'.{nearest(link, frames)} "
            f"Its links: {', '.join(sorted(frames))}."
        )
    frame = frames[link]
    joint = int(frame.parentJoint)
    if robot.first_joint <= joint and joint not in robot.model_joints:
        name = str(robot.model.names[joint])
        raise ConfigError(
            f"{where}: link '{link}' is carried by '{name}', which follows another joint (mimic). "
            "Name a link that a joint of its own carries."
        )
    if joint < robot.first_joint:
        raise ConfigError(
            f"{where}: no moved joint carries link '{link}', so its load shows in no torque. "
            f"Links that are moved: {', '.join(sorted(n for n in frames if _moved(robot, n)))}."
        )
    placement = frame.placement
    own = robot.model_joints.index(joint)
    return LinkFrame(link, own, np.array(placement.rotation), np.array(placement.translation))


def own_link(robot: Robot, joint: int) -> LinkFrame:
    """The link that stands in the frame of moved `joint`: the child of that joint."""
    names = [
        name
        for name, frame in _links(robot).items()
        if int(frame.parentJoint) == robot.model_joints[joint] and frame.placement.isIdentity()
    ]
    name = names[0] if names else robot.joint_names[joint]
    return LinkFrame(name, joint, np.eye(3), np.zeros(3))


def carrying_frame(robot: Robot, link: str | None, where: str) -> LinkFrame:
    """The link that `where` names, or the last one of a robot with one end.

    Raises
    ------
    ConfigError
        There is no such link, or the robot has several ends and none is named.
    """
    if link is not None:
        return link_frame(robot, link, where)
    ends = leaves(robot)
    if len(ends) > 1:
        names = ", ".join(own_link(robot, joint).name for joint in ends)
        raise ConfigError(f"{where}: the robot has several ends; name what carries it: {names}.")
    return own_link(robot, ends[0])


def leaves(robot: Robot) -> tuple[int, ...]:
    """Moved joints that carry no other moved joint."""
    return tuple(j for j in range(robot.n) if j not in robot.parents)


def branches(robot: Robot) -> list[tuple[int, ...]]:
    """For every leaf, the moved joints that carry it and no other leaf: an arm of two, a finger."""
    carried: list[set[int]] = [set() for _ in range(robot.n)]
    for leaf in leaves(robot):
        joint = leaf
        while joint >= 0:
            carried[joint].add(leaf)
            joint = robot.parents[joint]
    return [tuple(j for j in range(robot.n) if carried[j] == {leaf}) for leaf in leaves(robot)]


def links_ending(robot: Robot, end: str) -> list[str]:
    """Names of links that end so, whatever prefix a robot of several arms gives them."""
    return [name for name in _links(robot) if name.endswith(end)]


def _links(robot: Robot) -> dict[str, pin.Frame]:
    return {str(f.name): f for f in robot.model.frames if f.type == pin.FrameType.BODY}


def _moved(robot: Robot, link: str) -> bool:
    return int(_links(robot)[link].parentJoint) in robot.model_joints
