"""What there is to say of a record, in blocks: texts, tables, commands, charts, sections of them.

No block knows where it is shown, and whoever shows blocks (a terminal, a notebook, a page) knows
nothing else. A terminal and a notebook show no charts.
"""

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from html import escape
from types import MappingProxyType
from typing import Any, Literal, Self, TypeVar

from excite_cli.errors import ConfigError, nearest, optional_module


class Detail(IntEnum):
    """How much is said: in an answer, with `--verbose`, on a page."""

    BRIEF = 0
    VERBOSE = 1
    PAGE = 2


@dataclass(frozen=True)
class Command:
    """The words of a command, names of files as they are; `line` has them quoted for a shell."""

    words: tuple[str, ...]

    @property
    def line(self) -> str:
        """`excite optimize 'my arm.yaml'`."""
        return shlex.join(self.words)


def as_word(name: object) -> str:
    """The name of a file as a word of a command: one that begins with a minus is no option."""
    text = str(name)
    return f"./{text}" if text.startswith("-") else text


@dataclass(frozen=True)
class Table:
    """Rows of texts under a title; a cell may have several lines.

    `left`: columns of names and units, `words`: columns that may wrap where there is little room;
    all others hold figures and are aligned to the right. `bold`: rows by their number. Before the
    rows of `parted` there is a gap. `note` explains columns; where a page is shown, a table that is
    `folded` has to be opened. `shades`: how dark the cells of each row after the first are there,
    from 0 to 1. Cells of the columns `files` name files beside the page.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    bold: tuple[int, ...] = ()
    parted: tuple[int, ...] = ()
    note: str = ""
    folded: bool = False
    shades: tuple[tuple[float, ...], ...] = ()
    files: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raise ValueError for a row of another length than the columns, or an unknown column."""
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"'{self.title}': a row does not have {len(self.columns)} cells")
        unknown = {*self.left, *self.words} - {*self.columns}
        if unknown:
            raise ValueError(f"'{self.title}' has no columns {sorted(unknown)}")

    @classmethod
    def of(
        cls,
        title: str,
        rows: Iterable[Mapping[str, str]],
        left: tuple[str, ...] = (),
        words: tuple[str, ...] = (),
        **look: Any,
    ) -> Self:
        """A table of rows that have each cell beside the name of its column; others are empty.

        Names in `left` and `words` may be those of columns that are not there.
        """
        cells = list(rows)
        columns = tuple(dict.fromkeys(name for row in cells for name in row))
        texts = tuple(tuple(row.get(name, "") for name in columns) for row in cells)
        own_left, own_words = (
            tuple(name for name in names if name in columns) for names in (left, words)
        )
        return cls(title, columns, texts, own_left, own_words, **look)

    def is_left(self, column: str) -> bool:
        """Whether the cells of a column are aligned to the left."""
        return column in self.left or column in self.words


@dataclass(frozen=True)
class Text:
    """A paragraph; `kind` is `plain`, `answer`, `good`, `bad` or `code`."""

    text: str
    kind: str = "plain"


@dataclass(frozen=True)
class Charts:
    """Drawings side by side, as many as fit."""

    charts: tuple[Any, ...]
    title: str = ""


@dataclass(frozen=True)
class Fold:
    """Blocks behind a line that opens them."""

    summary: str
    blocks: tuple["Block", ...]


@dataclass(frozen=True)
class Choice:
    """Alternatives of which one is shown, and printed: a motion, a joint."""

    label: str
    options: tuple[tuple[str, tuple["Block", ...]], ...]


# What an answer has, in reading order: plain texts are texts without a kind.
Part = Table | Command | str
Parts = list[Part]
Block = Part | Text | Charts | Fold | Choice


@dataclass(frozen=True)
class Section:
    """A part of a document with an entry in its table of contents; `lead` is its finding.

    Answers have the blocks alone. `on_paper`: whether a page prints it.
    """

    anchor: str
    title: str
    blocks: tuple[Block, ...]
    lead: str = ""
    on_paper: bool = True


Verdict = Literal["", "good", "open", "bad"]


@dataclass(frozen=True)
class KeyFigure:
    """A figure that sums up a page: what it is, its value with unit, and a remark.

    `verdict` colours it; `anchor`: of the section that says more.
    """

    name: str
    value: str
    remark: str = ""
    verdict: Verdict = ""
    anchor: str = ""


@dataclass(frozen=True)
class Page:
    """What a report says, ready to be written; `answers` stand before all else."""

    title: str
    subtitle: str
    figures: tuple[KeyFigure, ...]
    sections: tuple[Section, ...]
    answers: tuple[Text, ...] = ()


def parts_of(sections: Iterable[Section]) -> Parts:
    """What an answer has of sections: no charts."""
    return list(_parts(block for section in sections for block in section.blocks))


def _parts(blocks: Iterable[Block]) -> Iterator[Part]:
    for block in blocks:
        if isinstance(block, Fold):
            yield from _parts(block.blocks)
        elif isinstance(block, Choice):
            yield from (part for _, inner in block.options for part in _parts(inner))
        elif isinstance(block, Table) and block.note:
            yield from (replace(block, note=""), block.note)
        elif not isinstance(block, Charts):
            yield block.text if isinstance(block, Text) else block


@dataclass(frozen=True)
class Answer:
    """`parts`: tables, sentences and commands in reading order; `data`: the same for `--json`.

    `good` is false where the work was done and its answer is bad (exit status 1).
    """

    parts: tuple[Part, ...]
    data: dict[str, Any] = field(default_factory=dict)
    good: bool = True


# Records that can be read: a few words in a console, tables in a notebook.
#
# A record says only that it is shown (it inherits from `Shown`, with `@dataclass(repr=False)`);
# the words and tables of each are written down in one package above all of them, which `show`
# connects.

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


# What a record offers in Python: rows of tables by their names, and what its `plot…` draw.
Offers = Mapping[str, Callable[..., Any]]
_OF_EFFECTS = ("effect", "joints", "parameter", "value", "std", "unit")  # where there are none


@dataclass(frozen=True)
class _Shown:
    words: Callable[[Any], str]
    parts: Callable[[Any], Parts]
    offers: Offers


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

    def table(self, name: str) -> Any:
        """A pandas DataFrame of a diagnosis or fit: "effects", "errors" or "parameters".

        `unit` is that of `value`, or of `rms_…`; `error_…`, `share…` and `gain` are shares.

        Raises ConfigError where there is no such table, MissingExtraError without pandas.
        """
        tables = {key: rows for key, rows in offered(self).items() if not key.startswith("plot")}
        if name not in tables:
            kind, own = type(self).__name__, ", ".join(tables) or "none"
            close = nearest(str(name), tables)
            raise ConfigError(f"{kind} has no table '{name}'. Tables: {own}.{close}")
        pandas = optional_module(
            "pandas",
            "Tables need pandas, which is not installed. Run: pip install 'excite-cli[tables]'",
        )
        rows = tables[name](self)
        return pandas.DataFrame(rows, columns=None if rows else _OF_EFFECTS)


T = TypeVar("T", bound=Shown)


def show(
    kind: type[T],
    words: Callable[[T], str],
    parts: Callable[[T], Parts],
    offers: Offers = MappingProxyType({}),
) -> None:
    """State how records of `kind` are shown: in words (inside brackets), as tables, in Python."""
    _known[kind] = _Shown(words, parts, offers)


def offered(record: Shown) -> Offers:
    """What the record offers in Python."""
    found = _found(type(record))
    return {} if found is None else found.offers


def _found(kind: type) -> _Shown | None:
    return next((_known[each] for each in kind.__mro__ if each in _known), None)
