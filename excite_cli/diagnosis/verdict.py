"""What became of a candidate, and what an effect is worth, as files and JSON call it."""

from enum import StrEnum


class Verdict(StrEnum):
    """Accepted, or why not."""

    ACCEPTED = "accepted"
    NOT_SIGNIFICANT = "not significant"
    IMPLAUSIBLE_SIZE = "implausible size"
    TOO_SMALL = "too small to matter"
    NO_GAIN = "no gain on data left out"
    LATER = "deferred"
    EXPLAINED = "redundant"


class HeldOutVerdict(StrEnum):
    """Whether the error on held-out data is lower with an effect, or higher, beyond chance.

    Or need not change: `WEIGHED`, where without the effect inertias that no scale would confirm
    predict as well.
    """

    CONFIRMED = "confirmed"
    NOT_CONFIRMED = "not confirmed"
    HARMFUL = "harmful"
    WEIGHED = "based on the known mass"
