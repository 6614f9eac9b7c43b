"""What a reader of motion files is: a path in, a `TimedMotion` with the file's own names out."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

from excite_cli.errors import FileError
from excite_cli.measurement.timed_motion import TimedMotion

MAX_TEXT = 200 * 10**6  # bytes of a text file that is held in memory as a tree


class MotionReader(ABC):
    """A file format for motions."""

    title: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]

    def recognises(self, path: Path, measured: tuple[str, ...] = ("tau",)) -> bool:
        """Whether the file holds a motion in this format; by its name, where that says enough.

        `measured`: how columns of torques or wrenches begin, which only measured data have.
        """
        return path.is_file() and path.name.lower().endswith(self.suffixes)

    @abstractmethod
    def read(self, path: Path) -> TimedMotion:
        """The file's motion, not yet checked.

        Raises
        ------
        FileError
            The file is damaged, too large, or lacks what is needed.
        MissingExtraError
            The library for this format is not installed.
        """


def text_of(path: Path) -> str:
    """The text of a file of limited size.

    Raises
    ------
    FileError
        It is too large, no text in UTF-8, or cannot be read.
    """
    try:
        if path.stat().st_size > MAX_TEXT:
            raise FileError(
                f"{path} is larger than {MAX_TEXT // 10**6} MB. Take CSV or .npz for so long a "
                "motion."
            )
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{path} is not a text in UTF-8: {error}.") from error
