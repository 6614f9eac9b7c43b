"""What is worth saying while work goes on: to a person at a terminal, or to a log.

Mathematics does not print. Who calls the library gives a `Tell`; without one, notes go to the
logger "excite", where Python shows warnings and keeps the rest for those who ask.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import update_wrapper
from typing import Any, TypeVar, cast


class Level(Enum):
    """How much a note matters; the value is the level of Python's logging."""

    STEP = logging.DEBUG - 1  # what begins now: seen by those who wait, while it lasts
    DETAIL = logging.DEBUG
    INFO = logging.INFO
    HINT = logging.INFO + 1
    NOTE = logging.INFO + 2
    WARNING = logging.WARNING


# Levels that are reported before the text.
_TOLD = {Level.HINT: "hint", Level.NOTE: "note", Level.WARNING: "warning"}


@dataclass(frozen=True)
class Note:
    """One sentence; `where` names what it is about, such as the runs of a recording.

    Of a step it is the title under which that step and what is done in it are shown.
    """

    level: Level
    text: str
    where: str = ""

    @property
    def sentence(self) -> str:
        """`warning (motion_1): …`, or the text alone."""
        if self.level not in _TOLD:
            return self.text
        return f"{_TOLD[self.level]}{f' ({self.where})' if self.where else ''}: {self.text}"


Tell = Callable[[Note], None]
F = TypeVar("F", bound=Callable[..., Any])


class _Readable:
    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self.__wrapped__(*args, **kwargs)  # type: ignore[attr-defined]

    def __repr__(self) -> str:
        return str(self.__qualname__)  # type: ignore[attr-defined]

    __reduce__ = __repr__  # kept by name, as functions are


def readable(function: F) -> F:
    """The function, shown as its name where it is the default of an argument."""
    return cast(F, _Readable(function))


@readable
def unheard(*told: object) -> None:
    """Tell nobody."""


@readable
def never(*asked: object) -> bool:
    """Say no, whenever it is asked."""
    return False


@readable
def log_note(note: Note) -> None:
    """Hand a note to Python's logger "excite"."""
    about = f"{note.where}: " if note.where else ""
    logging.getLogger("excite").log(note.level.value, "%s%s", about, note.text)


def saying(tell: Tell, level: Level = Level.INFO) -> Callable[[str], None]:
    """`tell` for those who have a text and no level."""
    return lambda text: tell(Note(level, text))
