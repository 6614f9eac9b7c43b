"""Why a pair of shapes is not checked: records, put into words by `geometry.words`."""

from dataclasses import dataclass
from enum import StrEnum


class Why(StrEnum):
    """The kinds of reasons."""

    SAME_BODY = "same_body"
    IGNORED = "ignored"
    BY_MESHES = "by_meshes"
    ADJACENT = "adjacent"
    NEVER_NEAR = "never_near"
    MESHES_NEVER_NEAR = "meshes_never_near"
    ALWAYS_TOUCHING = "always_touching"
    ALWAYS_NEAR = "always_near"
    UNGUARDED = "unguarded"
    OUT_OF_REACH = "out_of_reach"


class Standing(StrEnum):
    """What contact of two meshes means: a broken motion, or why it does not."""

    JUDGED = "judged"
    ALWAYS_TOUCHING = "always_touching"
    AT_POSTURE = "at_posture"
    BY_HAND = "by_hand"


# No motion within the limits brings these together.
NEVER = (Why.NEVER_NEAR, Why.MESHES_NEVER_NEAR)


@dataclass(frozen=True)
class LinksApart:
    """Two links whose meshes are apart in a `share` of postures though their capsules overlap."""

    first: str
    second: str
    share: float

    @property
    def percent(self) -> int:
        """The share as it is reported and judged: postures are few."""
        return round(100 * self.share)


@dataclass(frozen=True)
class Reason:
    """Why a pair is not checked.

    `distance` [m]: the least that was found, or how deep what always touches overlaps. `apart`:
    links of an unguarded pair that are apart at times.
    """

    why: Why
    distance: float | None = None
    apart: tuple[LinksApart, ...] = ()


@dataclass(frozen=True)
class DroppedPair:
    """Names of two shapes that are not checked against each other, and why."""

    first: str
    second: str
    reason: Reason
