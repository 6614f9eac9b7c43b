"""One self-contained page: blocks → HTML.

The page needs no network and no other file; style and script lie inside it. It reads on a phone
and on paper, in light and in dark, and without a script (which only adds choosing and sorting).
Every text is escaped by the template engine: names come from unchecked files.
"""

import functools
import hashlib
from importlib import import_module, resources
from typing import Any

from excite_cli.errors import optional_module
from excite_cli.report.chart import Chart
from excite_cli.report.plot import Plot
from excite_cli.shown.answer import Charts, Choice, Command, Fold, Page, Table, Text

_SCRIPTS = ("early.js", "page.js", "uplot/uPlot.iife.min.js", "plot.js")


_KINDS: dict[str, type] = {
    each.__name__: each for each in (Chart, Plot, Charts, Choice, Command, Fold, Table, Text, str)
}


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
    jinja2 = optional_module(
        "jinja2", "Reports need jinja2, which is not installed. Run: pip install 'excite-cli[plot]'"
    )
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_asset),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    safe = import_module("markupsafe").Markup
    environment.globals["policy"] = _policy()
    environment.globals["asset"] = lambda name: safe(_asset(name))
    environment.filters["drawing"] = lambda chart: safe(chart.svg)
    environment.filters["sentence"] = _sentence
    environment.filters["lines"] = _lines
    environment.tests["of_kind"] = lambda block, name: isinstance(block, _KINDS[name])
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
    markup = import_module("markupsafe")
    parts = [markup.escape(part) for part in text.split("`")]
    if len(parts) % 2 == 0:  # a lone backtick is no quotation
        return markup.escape(text)
    code = markup.Markup("<code>{}</code>")
    return markup.Markup("").join(
        code.format(part) if number % 2 else part for number, part in enumerate(parts)
    )


def _lines(text: str) -> Any:
    """Escaped text with its ends of lines."""
    markup = import_module("markupsafe")
    return markup.Markup("<br>").join(text.split("\n"))


def _base64(data: bytes) -> str:
    import base64

    return base64.b64encode(data).decode("ascii")
