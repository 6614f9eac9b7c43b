"""Arms, legs and other limbs of a robot, as groups of joints to choose from."""

from collections.abc import Sequence
from itertools import takewhile

from excite_cli.robot.urdf_joints import UrdfJoint


def limbs(joints: Sequence[UrdfJoint]) -> dict[str, tuple[str, ...]]:
    """Joints by limb: each chain without branches, by what its joints' names have in common."""
    names = {joint.name for joint in joints}
    ends = {
        joint.name: tuple(
            sorted(
                other.name
                for other in joints
                if not (names & set(other.beyond)) and other.name in (joint.name, *joint.beyond)
            )
        )
        for joint in joints
    }
    chains: dict[tuple[str, ...], list[str]] = {}
    for joint in joints:
        chains.setdefault(ends[joint.name], []).append(joint.name)
    groups: dict[str, tuple[str, ...]] = {}
    for chain in chains.values():
        word = _shared(chain).rstrip("_-0123456789 ") if len(chain) > 1 else chain[0]
        if not word or word in groups:
            word = f"{chain[0]} to {chain[-1]}"
        groups[word] = tuple(chain)
    return groups


def _shared(words: Sequence[str]) -> str:
    """The letters with which all words begin."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*words, strict=False))
    return "".join(letters[0] for letters in alike)
