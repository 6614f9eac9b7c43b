"""Which shapes stand for the links of a robot, and which links nothing can stand for."""

from dataclasses import dataclass

from excite_cli.robot.description import RobotDescription
from excite_cli.robot.mesh_paths import Unusable, unusable, without_unusable
from excite_cli.robot.urdf_joints import UrdfSurvey, survey


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
