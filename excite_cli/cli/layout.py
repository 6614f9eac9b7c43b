"""The one look of all tables: aligned columns under a rule, narrow enough for 80 columns.

Figures and names that people copy stay whole as long as there is room for them; words wrap before.
Nothing is ever cut off.
"""

from collections.abc import Collection, Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from excite_cli.api import showing

_GAP = 2


def table(
    title: str, columns: Sequence[str], left: Collection[str] = (), words: Collection[str] = ()
) -> Table:
    """An empty table; `left` columns hold names, `words` hold what may wrap, others figures."""
    found = Table(
        title=title,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, _GAP - 1, 0, 0),
        header_style="bold",
    )
    for name in columns:
        justify = "left" if name in left or name in words else "right"
        found.add_column(
            name,
            justify=justify,  # type: ignore[arg-type]
            no_wrap=name not in words,
            overflow="fold",
        )
    return found


def rendered(given: showing.Table) -> Table:
    """A table of the library in this look."""
    found = table(given.title, given.columns, given.left, given.words)
    for number, row in enumerate(given.rows):
        if number in given.parted:
            found.add_section()
        found.add_row(*row, style="bold" if number in given.bold else None)
    return found
