"""Which recording a run is, where it came from, and which part of it: what is asked about a run.

Names that people read (`label`) are made of these and never taken apart again.
"""

from collections.abc import Collection
from dataclasses import dataclass


@dataclass(frozen=True)
class RunId:
    """A recording by the `name` that data and configuration call it; of one with gaps, a stretch.

    `stretch` counts from 1; 0 is a recording in one piece, or all of it.
    """

    name: str = ""
    stretch: int = 0

    @property
    def key(self) -> str:
        """What a configuration calls just this stretch: `b/2`; the recording's name if whole."""
        return f"{self.name}/{self.stretch}" if self.stretch else self.name

    def is_among(self, names: Collection[str]) -> bool:
        """Whether the recording is named, or just this stretch of it."""
        return self.name in names or self.key in names


@dataclass(frozen=True)
class Origin:
    """The file of a recording and the place in it: a group (HDF5) or a topic (bag)."""

    file: str = ""
    place: str = ""


@dataclass(frozen=True)
class Part:
    """Which part of its recording a run is, from `start` to `end` [s] after the recording's start.

    `stretch` between two gaps and `block` of it, cut off for folds or holding out, count from 1; 0:
    not cut. The end is None where the recording's own is meant.
    """

    stretch: int = 0
    block: int = 0
    start: float = 0.0
    end: float | None = None
