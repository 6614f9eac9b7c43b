"""The look of tables, sentences and commands, as narrow as the terminal is.

Nothing is ever cut off, and no word is cut in two. Tables are aligned columns under a rule. Where
there is little room, their words wrap at spaces, then headers do; where that does not do either, a
table is shown in parts one below the other, each of which begins with the columns that say what a
row is about.
"""

import re
import textwrap
from collections.abc import Iterator, Sequence

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.table import Table

from excite_cli.api import showing

_GAP = 2
_NEXT_LINE = " " * 2
_ENOUGH_FOR_WORDS = 16
_GOES_ON = " \\"
# Words of a command line, quoted parts and all; an option with its value is one piece.
_WORD = r"""(?:[^\s'"\\]|\\.|'[^']*'|"(?:[^"\\]|\\.)*")+"""
_PIECE = re.compile(rf"-{_WORD}(?: +(?!-){_WORD})?|{_WORD}")


def rendered(given: showing.Table, width: int) -> Iterator[Table]:
    """A table of the library in this look, without its title, in as many parts as `width` asks."""
    columns = range(len(given.columns))
    widest = [max(map(cell_len, _lines(given, each))) for each in columns]
    if _total(widest) <= width:
        yield _part(given, list(columns), widest)
        return
    least = [_least(given, each) for each in columns]
    for part in _parts(_keys(given), least, width):
        yield _part(
            given, part, _shared([least[i] for i in part], [widest[i] for i in part], width)
        )


def wrapped(text: str, width: int) -> str:
    """Text in lines that end between words; a longer name of a file is not cut in two."""
    lines = (
        textwrap.wrap(
            line, width, break_long_words=False, break_on_hyphens=False, replace_whitespace=False
        )
        for line in text.split("\n")
    )
    return "\n".join(line for each in lines for line in each or [""])


def copyable(command: str, width: int) -> str:
    """A command line that can be pasted: where it is too long, lines that end in a backslash.

    An option and its value remain on one line, and a quoted name is one word, however long.
    """
    if cell_len(command) <= width:
        return command
    indent = " " * (len(command) - len(command.lstrip()))
    pieces = _PIECE.findall(command)
    lines, line = [], indent + pieces[0]
    for left, piece in enumerate(pieces[1:], start=2 - len(pieces)):
        room = width - len(_GOES_ON) if left else width
        if cell_len(f"{line} {piece}") <= room:
            line += f" {piece}"
        else:
            lines.append(line + _GOES_ON)
            line = indent + _NEXT_LINE + piece
    return "\n".join([*lines, line])


def _lines(given: showing.Table, column: int) -> list[str]:
    cells = [given.columns[column], *(row[column] for row in given.rows)]
    return [line for cell in cells for line in cell.split("\n")]


def _least(given: showing.Table, column: int) -> int:
    """The room that a column cannot do without; words are not put one below the other."""
    name, lines = given.columns[column], _lines(given, column)
    words = max((cell_len(word) for word in name.split()), default=0)
    widest = max(map(cell_len, lines[1:]), default=0)
    if name in given.words:
        longest = max((cell_len(word) for line in lines for word in line.split()), default=0)
        widest = min(widest, max(longest, _ENOUGH_FOR_WORDS))
    return max(words, widest)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + _GAP * (len(widths) - 1)


def _parts(keys: int, least: list[int], width: int) -> list[list[int]]:
    """Columns of each part: the first `keys` ones and as many others as there is room for."""
    begun = list(range(keys))
    parts = [[*begun]]
    for column in range(keys, len(least)):
        if len(parts[-1]) > keys and _total([least[i] for i in (*parts[-1], column)]) > width:
            parts.append([*begun])
        parts[-1].append(column)
    if keys > 1 and any(_total([least[i] for i in part]) > width for part in parts):
        return _parts(keys - 1, least, width)
    return parts


def _keys(given: showing.Table) -> int:
    """How many of the first columns tell the rows apart; one where two do not."""
    different = (len({row[:count] for row in given.rows}) == len(given.rows) for count in (1, 2))
    return next((count for count, enough in enumerate(different, start=1) if enough), 1)


def _shared(least: list[int], widest: list[int], width: int) -> list[int]:
    """Widths between the least and the widest of each column, wide ones made narrow first.

    Where the least is too much, names and figures that are wider than the terminal are folded.
    """
    widths = list(widest)
    while _total(widths) > width and widths != least:
        spare = [i for i, each in enumerate(widths) if each > least[i]]
        widths[max(spare, key=lambda i: widths[i])] -= 1
    return widths


def _part(given: showing.Table, columns: list[int], widths: list[int]) -> Table:
    found = Table(
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, _GAP - 1, 0, 0),
        header_style="bold",
    )
    for column, width in zip(columns, widths, strict=True):
        name = given.columns[column]
        found.add_column(
            name,
            justify="left" if name in given.left or name in given.words else "right",
            width=width,
            overflow="fold",
        )
    for number, row in enumerate(given.rows):
        if number in given.parted:
            found.add_section()
        style = "bold" if number in given.bold else None
        found.add_row(*(row[i] for i in columns), style=style)
    return found
