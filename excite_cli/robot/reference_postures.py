"""Reference postures that others have written for a robot: the group states of SRDF files."""

from collections.abc import Sequence
from pathlib import Path

from excite_cli.robot.srdf import Srdf

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
