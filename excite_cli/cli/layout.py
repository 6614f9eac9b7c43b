"""The one look of all tables: aligned columns under a rule, narrow enough for 80 columns.

Figures and names that people copy stay whole as long as there is room for them; words wrap before.
Nothing is ever cut off.
"""

from rich.box import SIMPLE_HEAD
from rich.table import Table

from excite_cli.api import showing

_GAP = 2


def rendered(given: showing.Table) -> Table:
    """A table of the library in this look, without its title."""
    found = Table(
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, _GAP - 1, 0, 0),
        header_style="bold",
    )
    for name in given.columns:
        found.add_column(
            name,
            justify="left" if name in given.left or name in given.words else "right",
            no_wrap=name not in given.words,
            overflow="fold",
        )
    for number, row in enumerate(given.rows):
        if number in given.parted:
            found.add_section()
        found.add_row(*row, style="bold" if number in given.bold else None)
    return found
