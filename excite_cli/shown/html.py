"""Tables, sentences and commands as HTML, for notebooks."""

from collections.abc import Iterable
from html import escape

from excite_cli.shown.command import Command
from excite_cli.shown.table import Part, Table


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
    side = "left" if column in table.left or column in table.words else "right"
    return f'<{tag} style="text-align: {side}">{_text(text)}</{tag}>'


def _text(text: str) -> str:
    return escape(text).replace("\n", "<br>")
