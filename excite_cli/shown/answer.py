"""The answer of a command, for people and for scripts: tables, sentences, commands to go on with.

None of them knows where it is shown: on a terminal, in a notebook, on a page.
"""

import shlex
from dataclasses import dataclass, field
from typing import Any


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
    rows of `parted` there is a gap.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    bold: tuple[int, ...] = ()
    parted: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Raise ValueError for a row of another length than the columns, or an unknown column."""
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"'{self.title}': a row does not have {len(self.columns)} cells")
        unknown = {*self.left, *self.words} - {*self.columns}
        if unknown:
            raise ValueError(f"'{self.title}' has no columns {sorted(unknown)}")


# What is shown of a record, in reading order: tables, sentences, commands to go on with.
Part = Table | Command | str
Parts = list[Part]


@dataclass(frozen=True)
class Answer:
    """`parts`: tables, sentences and commands in reading order; `data`: the same for `--json`.

    `good` is false where the work was done and its answer is bad (exit status 1).
    """

    parts: tuple[Part, ...]
    data: dict[str, Any] = field(default_factory=dict)
    good: bool = True
