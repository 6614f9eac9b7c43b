"""Why what a result says of a motion may not hold for it."""

from enum import StrEnum


class Doubt(StrEnum):
    """Why a motion does not count as proved, whatever its verdict; empty where it may."""

    NONE = ""
    CHANGED = "changed since it was proved"
    EARLIER = "written by an earlier version"
    OTHER_ROBOT = "proved for another robot than its file describes now"
