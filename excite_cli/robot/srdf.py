"""SRDF, what MoveIt and others write beside a URDF: postures, and pairs not to check.

Files that lie near a URDF are not trusted, and passed over where they cannot be read.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import allowed_files
from excite_cli.robot.description import MAX_URDF_BYTES

_MOST = 10  # files that are looked at
NEVER = "never"  # the reason of pairs that were not seen to touch, in lower case


@dataclass(frozen=True)
class Srdf:
    """A file's robot, joint values [rad or m] of its group states by name, and disabled pairs.

    disabled: two links, and the reason as the file gives it.
    """

    path: Path
    robot: str
    states: dict[str, dict[str, float]]
    disabled: tuple[tuple[str, str, str], ...]


def srdf_near(urdf: Path) -> list[Srdf]:
    """Those beside a URDF and in folders named `srdf` or `config`, within its own folder."""
    allowed = allowed_files(urdf)
    folders = [urdf.parent, *(urdf.parent / name for name in ("srdf", "config"))]
    folders += [urdf.parent.parent / name for name in ("srdf", "config")]
    paths = dict.fromkeys(path for folder in folders for path in sorted(folder.glob("*.srdf")))
    found = []
    for path in [each for each in paths if each.is_file() and allowed.has(each)][:_MOST]:
        try:
            found.append(read_srdf(path))
        except RobotError:
            continue
    return found


def read_srdf(path: Path) -> Srdf:
    """The content of a file.

    Raises
    ------
    RobotError
        It is missing, not XML without a document type, or too large.
    """
    try:
        if path.stat().st_size > MAX_URDF_BYTES:
            raise RobotError(f"{path} is larger than {MAX_URDF_BYTES // 10**6} MB: not an SRDF.")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RobotError(f"{path} cannot be read as text: {error}") from error
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise RobotError(f"{path} declares a document type or entities; an SRDF needs neither.")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise RobotError(f"{path} is not well-formed XML: {error}") from error
    disabled = tuple(
        (each.get("link1", ""), each.get("link2", ""), each.get("reason", ""))
        for each in root.iter("disable_collisions")
    )
    return Srdf(path, root.get("name", ""), _states(root), disabled)


def _states(root: ElementTree.Element) -> dict[str, dict[str, float]]:
    states = {}
    for state in root.iter("group_state"):
        values = {}
        for joint in state.findall("joint"):
            try:
                value = float(joint.get("value", ""))
            except ValueError:  # a free-flyer's pose
                continue
            if math.isfinite(value):
                values[joint.get("name", "")] = value
        states[state.get("name", "")] = values
    return states


# Reference postures that others have written for a robot: the group states of SRDF files.

# Standing and arms in front come before folded and stretched ones.
_PREFERRED = ("half_sitting", "standing", "home", "ready", "default", "neutral", "up")


def reference_posture(
    known: Sequence[Srdf], urdf: Path, joints: tuple[str, ...]
) -> tuple[str, str, dict[str, float]]:
    """The SRDF's name, the state's name and its joint values [rad or m], of the best known state.

    The best has values for most of `joints`; of equals, the one whose name tells of standing, then
    that of the file that is called like the URDF. Empty where there is none.
    """
    best: tuple[tuple[int, int, int], str, str, dict[str, float]] | None = None
    for srdf in known:
        for name, values in srdf.states.items():
            named = sum(joint in values for joint in joints)
            likeness = int(srdf.path.stem.split(".")[0] == urdf.stem)
            rank = (named, _preference(name), likeness)
            if named and (best is None or rank > best[0]):
                best = (rank, srdf.path.name, name, values)
    return ("", "", {}) if best is None else best[1:]


def _preference(name: str) -> int:
    for place, word in enumerate(_PREFERRED):
        if word in name:
            return len(_PREFERRED) - place
    return 0
