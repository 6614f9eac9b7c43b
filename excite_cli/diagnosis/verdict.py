"""What became of a candidate, as files and JSON call it."""

from enum import StrEnum


class Verdict(StrEnum):
    """Accepted, or why not."""

    ACCEPTED = "accepted"
    NOT_SIGNIFICANT = "not significant"
    IMPOSSIBLE_SIGN = "impossible sign"
    TOO_SMALL = "too small to matter"
    LEFTOVER = "what another effect leaves"
    NO_GAIN = "no gain on runs left out"
    LATER = "later"
    EXPLAINED = "another explains it"
