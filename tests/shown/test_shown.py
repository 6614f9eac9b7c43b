"""Notes, tables and records without a terminal."""

import logging
import shlex
from dataclasses import dataclass

import pytest

from excite_cli.shown.answer import Command, Shown, Table, as_html, show
from excite_cli.shown.note import Level, Note, log_note, saying


@dataclass(frozen=True, repr=False)
class Bare(Shown):
    """Nobody wrote words for it."""

    figure: float


@dataclass(frozen=True, repr=False)
class Told(Bare):
    """Words and a table are known."""


TABLE = Table(
    "a < b", ("name", "figure [m]"), (("<b>x</b>", "1.5"), ("two\nlines", "2")), ("name",), (), (1,)
)
show(Told, lambda told: f"figure {told.figure:g}", lambda told: ["one & two", TABLE])


def test_a_record_is_its_words_and_its_tables() -> None:
    assert repr(Told(1.5)) == "Told(figure 1.5)"
    html = Told(1.5)._repr_html_()
    assert html is not None
    assert html.startswith("<p>one &amp; two</p>")
    assert "<p><b>a &lt; b</b></p>" in html


def test_a_record_without_words_says_what_it_is() -> None:
    assert repr(Bare(1.5)) == "Bare(…)"
    assert Bare(1.5)._repr_html_() is None


def test_records_below_one_with_words_inherit_them() -> None:
    class Special(Told):
        pass

    assert repr(Special(2.0)) == "Special(figure 2)"


def test_html_is_escaped_aligned_and_bold() -> None:
    html = as_html([TABLE])
    assert '<td style="text-align: left">&lt;b&gt;x&lt;/b&gt;</td>' in html
    assert '<td style="text-align: right">1.5</td>' in html
    assert '<th style="text-align: left">two<br>lines</th>' in html
    assert html.count("<tr>") == 3


def test_a_command_is_quoted_for_a_shell() -> None:
    command = Command(("excite", "optimize", "my <arm>.yaml", "--after", "it's.h5"))
    assert shlex.split(command.line) == list(command.words)
    html = as_html([command])
    assert html.startswith("<pre>excite optimize &#x27;my &lt;arm&gt;.yaml&#x27; --after ")


def test_a_table_has_as_many_cells_as_columns() -> None:
    with pytest.raises(ValueError, match="2 cells"):
        Table("t", ("a", "b"), (("1",),))
    with pytest.raises(ValueError, match="no columns"):
        Table("t", ("a",), (("1",),), left=("b",))


@pytest.mark.parametrize(
    ("note", "sentence", "level"),
    [
        (Note(Level.INFO, "text"), "text", logging.INFO),
        (Note(Level.DETAIL, "text"), "text", logging.DEBUG),
        (Note(Level.WARNING, "text", "a, b"), "warning (a, b): text", logging.WARNING),
        (Note(Level.HINT, "text"), "hint: text", logging.INFO),
        (Note(Level.NOTE, "text"), "note: text", logging.INFO),
    ],
)
def test_notes_are_told_and_logged(
    note: Note, sentence: str, level: int, caplog: pytest.LogCaptureFixture
) -> None:
    assert note.sentence == sentence
    with caplog.at_level(logging.DEBUG, logger="excite"):
        log_note(note)
    (record,) = caplog.records
    assert level <= record.levelno <= level + 2
    assert record.getMessage().endswith("text")
    assert all(name in record.getMessage() for name in note.where.split(", "))


def test_a_text_becomes_a_note() -> None:
    heard: list[Note] = []
    saying(heard.append, Level.WARNING)("far")
    assert heard == [Note(Level.WARNING, "far")]
