"""Reference postures that others have written for a robot: the group states of SRDF files."""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from excite_cli.robot.description import MAX_URDF_BYTES, RobotDescription

# Standing and arms in front come before folded and stretched ones.
_PREFERRED = ("half_sitting", "standing", "home", "ready", "default", "neutral", "up")


def reference_posture(
    description: RobotDescription, joints: tuple[str, ...]
) -> tuple[str, str, dict[str, float]]:
    """The SRDF's name, the state's name and its joint values [rad or m], of the best known state.

    The best has values for most of `joints`; of equals, the one whose name tells of standing. Files
    are looked for beside the URDF and in folders named `srdf` or `config` of its package. Files
    that cannot be read are passed over. Empty where there is none.
    """
    best: tuple[tuple[int, int, int], str, str, dict[str, float]] | None = None
    for path in _files(description.path):
        for name, values in _states(path).items():
            named = sum(joint in values for joint in joints)
            likeness = int(path.stem.split(".")[0] == description.path.stem)
            rank = (named, _preference(name), likeness)
            if named and (best is None or rank > best[0]):
                best = (rank, path.name, name, values)
    return ("", "", {}) if best is None else best[1:]


def _files(urdf: Path) -> list[Path]:
    folders = [urdf.parent, *(urdf.parent / name for name in ("srdf", "config"))]
    folders += [urdf.parent.parent / name for name in ("srdf", "config")]
    found = [path for folder in folders for path in sorted(folder.glob("*.srdf"))]
    return list(dict.fromkeys(found))


def _states(path: Path) -> dict[str, dict[str, float]]:
    try:
        if path.stat().st_size > MAX_URDF_BYTES:
            return {}
        text = path.read_text(encoding="utf-8")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            return {}
        root = ElementTree.fromstring(text)
    except (OSError, UnicodeDecodeError, ElementTree.ParseError):
        return {}
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


def _preference(name: str) -> int:
    for place, word in enumerate(_PREFERRED):
        if word in name:
            return len(_PREFERRED) - place
    return 0
