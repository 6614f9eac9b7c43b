"""One self-contained page: sections of charts, tables and texts → HTML.

The page needs no network and no other file; style and script lie inside it. It reads on a phone
and on paper, in light and in dark, and without a script (which only adds choosing and sorting).
Every text is escaped by the template engine: names come from unchecked files.
"""

import functools
import hashlib
import importlib
from dataclasses import dataclass
from importlib import resources
from typing import Any, get_args

from excite_cli.errors import MissingExtraError
from excite_cli.report.chart import Chart
from excite_cli.report.plot import Plot

_SCRIPTS = ("early.js", "page.js", "uplot/uPlot.iife.min.js", "plot.js")


@dataclass(frozen=True)
class TableBlock:
    """Rows of texts under `columns`; columns numbered in `right` are aligned as numbers.

    `folded`: shown only when opened. `strong`: numbers of rows to stress. Columns numbered in
    `wordy` hold sentences and stay wide enough for them.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""
    right: frozenset[int] = frozenset()
    note: str = ""
    folded: bool = False
    strong: frozenset[int] = frozenset()
    wordy: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Text:
    """A paragraph; `kind` is `plain`, `good`, `bad` or `code`."""

    text: str
    kind: str = "plain"


@dataclass(frozen=True)
class Charts:
    """Charts side by side, as many as fit."""

    charts: tuple[Chart | Plot, ...]
    title: str = ""


@dataclass(frozen=True)
class Fold:
    """Blocks behind a line that opens them."""

    summary: str
    blocks: tuple["Block", ...]


@dataclass(frozen=True)
class ChoiceBlock:
    """Alternatives of which one is shown: a motion, a joint. On paper all are printed."""

    label: str
    options: tuple[tuple[str, tuple["Block", ...]], ...]


Block = Chart | Plot | Charts | TableBlock | Text | Fold | ChoiceBlock
_KINDS = {kind.__name__: kind for kind in get_args(Block)}


@dataclass(frozen=True)
class PageSection:
    """A part of the page with an entry in its table of contents; `lead` is its finding."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]
    lead: str = ""


@dataclass(frozen=True)
class KeyFigure:
    """A figure that sums up the page: what it is, its value with unit, and a remark."""

    name: str
    value: str
    remark: str = ""


@dataclass(frozen=True)
class Page:
    """What a report says, ready to be written; `answers` stand before all else."""

    title: str
    subtitle: str
    figures: tuple[KeyFigure, ...]
    sections: tuple[PageSection, ...]
    answers: tuple[Text, ...] = ()


def render(page: Page) -> str:
    """The whole page as HTML text.

    Raises
    ------
    MissingExtraError
        jinja2 is not installed.
    """
    counter = iter(range(1, 1_000_000))
    environment = _environment()
    environment.globals["next_number"] = lambda: next(counter)
    return str(environment.get_template("page.html").render(page=page))


def _environment() -> Any:
    try:
        jinja2 = importlib.import_module("jinja2")
    except ImportError as error:
        raise MissingExtraError(
            "Reports need jinja2, which is not installed. Run: pip install 'excite-cli[plot]'"
        ) from error
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_asset),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    safe = importlib.import_module("markupsafe").Markup
    environment.globals["policy"] = _policy()
    environment.globals["asset"] = lambda name: safe(_asset(name))
    environment.filters["drawing"] = lambda chart: safe(chart.svg)
    environment.filters["sentence"] = _sentence
    environment.tests["of_kind"] = lambda block, name: type(block) is _KINDS[name]
    return environment


@functools.cache
def _policy() -> str:
    """What a browser lets the page do: run its own scripts, and load nothing."""
    digests = (hashlib.sha256(_asset(name).encode()).digest() for name in _SCRIPTS)
    own = " ".join(f"'sha256-{_base64(digest)}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {own}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


@functools.cache
def _asset(name: str) -> str:
    return (resources.files("excite_cli.report") / "assets" / name).read_text(encoding="utf-8")


def _sentence(text: str) -> Any:
    """Escaped text in which `commands` between backticks are set as code."""
    markup = importlib.import_module("markupsafe")
    parts = [markup.escape(part) for part in text.split("`")]
    if len(parts) % 2 == 0:  # a lone backtick is no quotation
        return markup.escape(text)
    code = markup.Markup("<code>{}</code>")
    return markup.Markup("").join(
        code.format(part) if number % 2 else part for number, part in enumerate(parts)
    )


def _base64(data: bytes) -> str:
    import base64

    return base64.b64encode(data).decode("ascii")
