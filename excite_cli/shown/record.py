"""Records that can be read: a few words in a console, tables in a notebook.

A record says only that it is shown (it inherits from `Shown`, with `@dataclass(repr=False)`); the
words and tables of each are written down in one package above all of them, which `show` connects.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from excite_cli.shown.html import as_html
from excite_cli.shown.table import Parts


@dataclass(frozen=True)
class _Shown:
    words: Callable[[Any], str]
    parts: Callable[[Any], Parts]


_known: dict[type, _Shown] = {}


class Shown:
    """A record with a readable `repr`, and tables in notebooks."""

    __slots__ = ()

    def __repr__(self) -> str:
        """One to few lines; the name of the class where no words were given for it."""
        found = _found(type(self))
        return f"{type(self).__name__}({'…' if found is None else found.words(self)})"

    def _repr_html_(self) -> str | None:
        """What notebooks show: the tables of the terminal."""
        found = _found(type(self))
        return None if found is None else as_html(found.parts(self))


T = TypeVar("T", bound=Shown)


def show(kind: type[T], words: Callable[[T], str], parts: Callable[[T], Parts]) -> None:
    """State how records of `kind` are shown: in words (inside brackets), and as tables."""
    _known[kind] = _Shown(words, parts)


def _found(kind: type) -> _Shown | None:
    return next((_known[each] for each in kind.__mro__ if each in _known), None)
