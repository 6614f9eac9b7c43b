"""A table that does not know where it is shown: on a terminal, in a notebook, on a page."""

from dataclasses import dataclass

from excite_cli.shown.command import Command


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
