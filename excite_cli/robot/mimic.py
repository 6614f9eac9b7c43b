"""Joints that a URDF lets follow others: <mimic joint="…" multiplier="…" offset="…"/>.

A joint may follow one that follows another; what is told here is the joint at the end of the chain,

    q = multiplier · q_driver + offset.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import RobotError, nearest

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
