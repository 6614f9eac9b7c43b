"""Which shapes stand for the links of a robot, and which links nothing can stand for."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.proposal.assumed_limits import JointPlan
from excite_cli.robot.description import RobotDescription
from excite_cli.robot.mesh_paths import Unusable, unusable, without_unusable
from excite_cli.robot.urdf_joints import UrdfSurvey, survey
from excite_cli.trajectory.freedom import harmonics_for


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


# How long a motion should be, and how many harmonics it should have.

_SHORTEST, _LONGEST = 10.0, 20.0
# How far the slowest joint should come either way: this share of half of its range, at most.
_SHARE, _FAR, _FAR_SLIDE = 0.5, 0.8, 0.1
# Forty instants to a period of the highest harmonic; what lies between them is proved.
_INSTANTS = 200


@dataclass(frozen=True)
class Pace:
    """Seconds of one motion, harmonics, instants of the constraint grid.

    slowest: the joint that asks for so long a motion; None where the usual length is enough.
    """

    duration: float
    harmonics: int
    constraint_samples: int
    slowest: str | None

    @property
    def base_frequency(self) -> float:
        """ω [rad/s]."""
        return 2 * math.pi / self.duration


def choose_pace(joints: Sequence[JointPlan]) -> Pace:
    """The pace that lets the slowest joint use half of its range with the first harmonic."""
    needed = []
    for joint in joints:
        far = min(_SHARE * joint.width / 2, _FAR_SLIDE if joint.sliding else _FAR)
        needed.append(2 * math.pi * far / joint.velocity)
    slowest = int(np.argmax(needed))
    duration = float(math.ceil(min(max(needed[slowest], _SHORTEST), _LONGEST)))
    usual = needed[slowest] <= _SHORTEST
    harmonics = harmonics_for(duration, np.array([joint.acceleration for joint in joints]))
    return Pace(duration, harmonics, _INSTANTS, None if usual else joints[slowest].name)
