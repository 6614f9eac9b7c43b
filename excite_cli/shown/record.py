"""Records that can be read: a few words in a console, tables in a notebook.

A record says only that it is shown (it inherits from `Shown`, with `@dataclass(repr=False)`); the
words and tables of each are written down in one package above all of them, which `show` connects.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from html import escape
from typing import Any, TypeVar

from excite_cli.shown.answer import Command, Part, Parts, Table

# Tables, sentences and commands as HTML, for notebooks.


def as_html(parts: Iterable[Part]) -> str:
    """Tables and paragraphs, without style but the alignment; texts are escaped."""
    return "\n".join(map(_part, parts))


def _part(part: Part) -> str:
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Command):
        return f"<pre>{escape(part.line)}</pre>"
    return f"<p>{_text(part)}</p>"


def _table(table: Table) -> str:
    head = "".join(_cell(table, "th", name, name) for name in table.columns)
    rows = "\n".join(
        "<tr>" + "".join(_row(table, number, row)) + "</tr>"
        for number, row in enumerate(table.rows)
    )
    title = f"<p><b>{_text(table.title)}</b></p>\n" if table.title else ""
    return f"{title}<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>"


def _row(table: Table, number: int, row: tuple[str, ...]) -> list[str]:
    tag = "th" if number in table.bold else "td"
    return [_cell(table, tag, name, text) for name, text in zip(table.columns, row, strict=True)]


def _cell(table: Table, tag: str, column: str, text: str) -> str:
    side = "left" if table.is_left(column) else "right"
    return f'<{tag} style="text-align: {side}">{_text(text)}</{tag}>'


def _text(text: str) -> str:
    return escape(text).replace("\n", "<br>")


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
