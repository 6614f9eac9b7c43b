"""Why a pair of shapes is not checked, as records and in words."""

from collections import Counter
from collections.abc import Sequence
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


class ContactMeaning(StrEnum):
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


# Pairs that are not checked, in words, the same ones wherever they are reported.

_WHY = {
    Why.SAME_BODY: "same body",
    Why.IGNORED: "ignored in the config",
    Why.BY_MESHES: "checked by their meshes, as configured",
    Why.ADJACENT: "adjacent",
    Why.NEVER_NEAR: "never near",
    Why.MESHES_NEVER_NEAR: "meshes never near",
    Why.ALWAYS_TOUCHING: "always in contact",
    Why.ALWAYS_NEAR: "always nearer than the margin",
    Why.UNGUARDED: "unguarded: capsules always overlap",
    Why.OUT_OF_REACH: "out of reach",
}
_STANDING = {
    ContactMeaning.JUDGED: "",
    ContactMeaning.ALWAYS_TOUCHING: "always in contact",
    ContactMeaning.AT_POSTURE: "in contact at the posture",
    ContactMeaning.BY_HAND: "capsule given by hand",
}


def why_in_words(why: Why) -> str:
    """A kind of reason, without figures."""
    return _WHY[why]


def standing_in_words(standing: ContactMeaning) -> str:
    """Why contact of two meshes breaks nothing; empty where it does."""
    return _STANDING[standing]


def reason_in_words(reason: Reason) -> str:
    """A reason with its figures: `never near (at least 0.12 m found)`."""
    figures = []
    if reason.distance is not None:
        figures = [_FIGURES[reason.why].format(reason.distance)]
    if reason.apart:
        links = (f"{each.first} – {each.second} {each.percent}%" for each in reason.apart)
        figures.append(f"meshes separated: {', '.join(links)}")
    return why_in_words(reason.why) + (f" ({'; '.join(figures)})" if figures else "")


_FIGURES = {
    Why.NEVER_NEAR: "at least {:.2f} m found",
    Why.MESHES_NEVER_NEAR: "at least {:.3f} m found",
    Why.ALWAYS_TOUCHING: "up to {:.3f} m deep",
    Why.UNGUARDED: "up to {:.3f} m deep",
    Why.ALWAYS_NEAR: "distance at least {:.3f} m",
}


def dropped_in_words(pair: DroppedPair) -> str:
    """`upper_arm – base: adjacent`."""
    return f"{pair.first} – {pair.second}: {reason_in_words(pair.reason)}"


def counted_reasons(dropped: Sequence[DroppedPair]) -> str:
    """How many pairs were dropped for each reason, figures in the reasons left aside."""
    counts = Counter(pair.reason.why for pair in dropped)
    told = (f"{count} {why_in_words(why)}" for why, count in counts.most_common())
    return ", ".join(told) or "none"
