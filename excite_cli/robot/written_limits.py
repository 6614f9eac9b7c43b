"""Position limits as the file of a robot writes them, whatever its format.

Two equal limits hold a joint there. Reversed ones are taken the other way round: between them lies
what the robot can do. Only 0 and 0, which is also what a file without limits gives, is no limit.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from excite_cli.errors import RobotError

UNBOUNDED = 1e9  # rad or m; from here on a figure is no limit
_KINDS = ("revolute", "prismatic")


def ordered_limits(path: Path, root: ElementTree.Element) -> dict[str, str]:
    """Put the limits of a URDF's tree in order; what was done, in words, by the joint's name.

    Raises
    ------
    RobotError
        The limits of a joint are both beyond all that a robot can reach.
    """
    said = {}
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if joint.get("type") not in _KINDS or limit is None:
            continue
        name = joint.get("name", "")
        texts = limit.get("lower", "0"), limit.get("upper", "0")
        lower, upper = map(float, texts)
        if lower > upper:
            limit.set("lower", texts[1])
            limit.set("upper", texts[0])
            said[name] = (
                f"the position limits of {name} are reversed in {path.name}, {lower:g} to "
                f"{upper:g}: they are taken as {upper:g} to {lower:g}"
            )
        if min(lower, upper) >= UNBOUNDED or max(lower, upper) <= -UNBOUNDED:
            raise RobotError(
                f"{path}: joint '{name}' has the position limits {lower:g} and {upper:g}, which no "
                "robot can reach. Positions are in rad (m for prismatic joints)."
            )
    return said
