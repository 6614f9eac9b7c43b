"""Which shapes stand for the links of a robot, and which pairs of links its author ruled out."""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import allowed_files
from excite_cli.robot.description import RobotDescription
from excite_cli.robot.mesh_paths import Unusable, unusable, without_unusable
from excite_cli.robot.urdf_check import xml_text
from excite_cli.robot.urdf_joints import UrdfSurvey, link_at, survey

# SRDF, what MoveIt and others write beside a URDF: postures, and pairs not to check.
#
# Files that lie near a URDF are not trusted, and passed over where they cannot be read.

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
        root = ElementTree.fromstring(xml_text(path, "an SRDF"))
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


@dataclass(frozen=True)
class Shapes:
    """A robot as far as its shapes can be read.

    facts: of the URDF without shapes that cannot be used; visual: whether visual shapes stand for
    links without collision shapes; without: links whose meshes cannot be used, with the reasons.
    """

    facts: UrdfSurvey
    visual: bool
    without: dict[str, Unusable]

    @property
    def any(self) -> bool:
        """Whether anything can be kept apart."""
        return self.facts.has_shapes or self.visual

    def in_words(self, source: str) -> list[str]:
        """What is not guarded and why, and what visual shapes are taken for."""
        links: dict[str, list[str]] = {}
        words: dict[str, str] = {}
        for link, why in self.without.items():
            group = why.cause or why.words
            links.setdefault(group, []).append(link)
            words.setdefault(group, why.words)
        notes = [f"NOT GUARDED: {', '.join(links[group])}: {words[group]}" for group in links]
        if self.visual:
            bare = ", ".join(self.facts.unguarded)
            notes.append(
                f"no collision geometry moves with {bare}: the visual shapes are taken there"
            )
        elif not self.facts.has_shapes:
            which = "that can be read" if self.without else ""
            notes.append(
                f"{source} has no collision geometry {which}".rstrip()
                + ": self-collision is not checked"
            )
        return notes


def choose_shapes(description: RobotDescription) -> Shapes:
    """Collision shapes, visual ones where whole bodies have none, as far as they can be used."""
    without = unusable(description, "collision")
    facts = survey(without_unusable(description, tuple(without)))
    if not facts.unguarded:
        return Shapes(facts, False, without)
    unseen = unusable(description, "visual")
    lacking = {**without, **{link: why for link, why in unseen.items() if link not in without}}
    seen = survey(without_unusable(description, tuple(lacking)))
    if not seen.unguarded:  # none of the visual shapes that are needed is there
        return Shapes(facts, False, without)
    return Shapes(seen, True, lacking)


# Pairs of links whose contact the robot's author ruled out: of an SRDF, or of MJCF's <exclude>.


@dataclass(frozen=True)
class DisabledPairs:
    """Pairs that are not kept apart, where they come from (""), and what else there is to say."""

    pairs: tuple[tuple[str, str], ...] = ()
    source: str = ""
    notes: tuple[str, ...] = ()

    @property
    def in_words(self) -> str:
        """For the comment beside the pairs."""
        many = f"{len(self.pairs)} pairs of links" if len(self.pairs) > 1 else "1 pair of links"
        return f"NOT GUARDED: {many} as {self.source}"


def disabled_pairs(
    description: RobotDescription, srdf: Srdf | None, moved: Sequence[str], visual: bool = False
) -> DisabledPairs:
    """Pairs that would be kept apart were they not disabled, with `moved` joints that move.

    visual: visual shapes count where a link has none for collisions.

    Those that an SRDF disables since they were never seen to touch are kept apart all the same: its
    word rests on random postures, and keeping apart what never meets costs nothing.
    """
    given = [(one, other, "") for one, other in description.ignored]
    source = f"{description.path.name} excludes them" if given else ""
    if srdf is not None and srdf.disabled:
        beside = f"{source}, and " if given else ""
        given += srdf.disabled
        source = f"{beside}{srdf.path.name} disables them"
    bodies = _Bodies(description, moved, visual)
    wanted, never, unknown = [], set(), set()
    for one, other, reason in given:
        unknown |= {name for name in (one, other) if name not in bodies.of}
        if unknown & {one, other} or not bodies.may_meet(one, other):
            continue
        if reason.lower() == NEVER:
            never.add(frozenset((one, other)))
        else:
            wanted.append((min(one, other), max(one, other)))
    pairs = tuple(dict.fromkeys(wanted))
    notes = []
    if never:
        notes.append(
            f"{len(never)} pairs that {srdf.path.name if srdf else ''} disables as never in "
            "contact are checked all the same"
        )
    if unknown:
        names = ", ".join(sorted(unknown)[:6])
        notes.append(f"links of {srdf.path.name if srdf else ''} that are not here: {names}")
    return DisabledPairs(pairs, source if pairs else "", tuple(notes))


def chosen_srdf(near: Sequence[Srdf], description: RobotDescription) -> Srdf | None:
    """That of this robot: called like the URDF, or the only one for a robot of its name."""
    root = ElementTree.fromstring(description.xml)
    stem = description.path.stem.split(".")[0]
    alike = [each for each in near if each.path.stem.split(".")[0] == stem]
    named = [each for each in near if each.robot == root.get("name")]
    return alike[0] if alike else named[0] if len(named) == 1 else None


class _Bodies:
    """Links by the body that they are part of while only some joints move, and their shapes."""

    def __init__(self, description: RobotDescription, moved: Sequence[str], visual: bool) -> None:
        root = ElementTree.fromstring(description.xml)
        kinds = ("collision", "visual") if visual else ("collision",)
        self._solid = {
            link.get("name", "")
            for link in root.findall("link")
            if any(link.find(f"{kind}/geometry") is not None for kind in kinds)
        }
        joints = [
            (link_at(joint, "parent"), link_at(joint, "child"), joint.get("name") in moved)
            for joint in root.findall("joint")
        ]
        children: dict[str, list[tuple[str, bool]]] = {}
        for parent, child, moves in joints:
            children.setdefault(parent, []).append((child, moves))
        self._joined = {frozenset((parent, child)) for parent, child, _ in joints}
        below = {child for _, child, _ in joints}
        names = [link.get("name", "") for link in root.findall("link")]
        first = [name for name in names if name not in below]
        self.of = {name: name for name in first}
        todo = list(first)
        while todo:
            parent = todo.pop()
            for child, moves in children.get(parent, ()):
                self.of[child] = child if moves else self.of[parent]
                todo.append(child)

    def may_meet(self, one: str, other: str) -> bool:
        """Whether two links have shapes, move against each other, and no joint joins them."""
        apart = self.of[one] != self.of[other] and frozenset((one, other)) not in self._joined
        return apart and {one, other} <= self._solid
