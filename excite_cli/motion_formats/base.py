"""What a motion format is: a path in, a `TimedMotion` with the file's own names out, and back."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from excite_cli.atomic import write_atomically

if TYPE_CHECKING:
    from excite_cli.motion_formats.timed_motion import TimedMotion


class MotionFormat(ABC):
    """A file format for motions, called `name` by `excite export --format`.

    `title` is what messages call it. Files are written with the first of the `suffixes`, and read
    with any. `whole_nanoseconds`: its instants are integers, so that the motion must be sampled at
    such. `folder`: what it writes is a folder.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    whole_nanoseconds: ClassVar[bool] = False
    folder: ClassVar[bool] = False

    @property
    def suffix(self) -> str:
        """Of what it writes; empty of folders."""
        return "" if self.folder else self.suffixes[0]

    def recognises(self, path: Path, measured: tuple[str, ...] = ("tau",)) -> bool:
        """Whether the file holds a motion in this format; by its name, where that says enough.

        `measured`: how columns of torques or wrenches begin, which only measured data have.
        """
        return path.is_file() and path.name.lower().endswith(self.suffixes)

    def may_replace(self, path: Path) -> bool:
        """Whether what stands at `path` is of this kind; only then --overwrite replaces it."""
        return path.is_file()

    @abstractmethod
    def read(self, path: Path) -> TimedMotion:
        """The file's motion, not yet checked; FileError if it is damaged or lacks something."""

    def write(self, path: Path, motion: TimedMotion) -> None:
        """Write `motion` whole or not at all; FileError if that cannot be."""
        write_atomically(path, lambda temporary: self.fill(temporary, motion))

    @abstractmethod
    def fill(self, path: Path, motion: TimedMotion) -> None:
        """Write to the new file `path`, which is put in its place if that succeeds."""
