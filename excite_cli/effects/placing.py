"""Where an effect is put that somebody names by joints or links: in a config, or on a command."""

from collections.abc import Sequence

from excite_cli.effects.base import Effect
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.link_frame import LinkFrame, leaves, link_frame, own_link
from excite_cli.robot.model import Robot

ALL = "all"


def places_named(
    kind: type[Effect], names: Sequence[str], robot: Robot, where: str
) -> list[tuple[int, ...]]:
    """The sets of joints that `names` of moved joints, or `all`, stand for.

    What is carried may be named by its link too, each on its own.

    Raises
    ------
    ConfigError
        A name is unknown, or the joints do not fit the kind.
    """
    everything = tuple(range(robot.n))
    if kind.scope == "base":
        if not robot.base_joints:
            raise ConfigError(
                f"{where}: {kind.kind} is of a measured wrench, and robot.rows has no 'base'."
            )
        return kind.places(robot)
    if list(names) == [ALL]:
        whole = kind.scope == "robot" and not kind.carried
        return [everything] if whole else kind.places(robot)
    joints = tuple(dict.fromkeys(_joint(kind, name, robot, where) for name in names))
    if kind.carried and set(joints) == set(everything):
        return [(j,) for j in leaves(robot)]  # as earlier versions named the whole robot
    if kind.scope == "joint" or kind.carried:
        return [(j,) for j in joints]
    if kind.scope == "pair" and len(joints) != 2:
        raise ConfigError(f"{where}: {kind.kind} acts on two joints; name exactly two.")
    return [joints]


def _joint(kind: type[Effect], name: str, robot: Robot, where: str) -> int:
    if name in robot.joint_names:
        return robot.joint_names.index(name)
    if kind.carried and any(str(frame.name) == name for frame in robot.model.frames):
        return link_frame(robot, name, where).joint
    links = "; or the name of a link" if kind.carried else ""
    raise ConfigError(
        f"{where}: no moved joint '{name}'.{nearest(name, robot.joint_names)} "
        f"Moved joints: {', '.join(robot.joint_names)}; or '{ALL}'{links}."
    )


def told_on(effect: Effect, robot: Robot, links: Sequence[str]) -> LinkFrame | None:
    """Of something carried, the link in whose frame it is told: the first of `links` there.

    By default the child of the joint that carries it.
    """
    if not effect.carried:
        return None
    named = [link_frame(robot, link, "diagnosis.carrying_links") for link in links]
    there = [each for each in named if each.joint == effect.joints[-1]]
    return there[0] if there else own_link(robot, effect.joints[-1])
