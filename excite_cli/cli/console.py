"""What a command says: tables and messages, progress, JSON.

stdout is the answer (a table, or JSON with `--json`), stderr is progress and messages.
"""

import json
import math
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from excite_cli.api.showing import Answer, Command, Level, Note, Part, Table
from excite_cli.cli.layout import copyable, rendered, wrapped
from excite_cli.cli.waiting import InLog, Line, OnTerminal, Waiting
from excite_cli.errors import ExciteWarning

# Off a terminal rows stay whole, so that they can be searched and cut.
_WHOLE_ROWS = 10_000
# Names in files may hold what a terminal obeys: C0 and C1, but for the tab and the end of a line.
_OBEYED = dict.fromkeys({*range(0x20), *range(0x7F, 0xA0)} - {ord("\t"), ord("\n")})


@dataclass(frozen=True)
class Terminal:
    """How much a command says, and in which form."""

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False
    progress: bool = True

    @property
    def out(self) -> Console:
        """The answer."""
        return _console(sys.stdout)

    @property
    def err(self) -> Console:
        """Progress and messages."""
        return _messages()

    def say(self, text: str) -> None:
        """A message for people, unless quiet."""
        if not self.quiet:
            _print_words(self.err, text)

    def detail(self, text: str) -> None:
        """A message for those who asked for more."""
        if self.verbose:
            _print_words(self.err, text)

    def tell(self, note: Note) -> None:
        """Progress messages of the library."""
        if note.level is Level.STEP:
            _shown[-1].begin(note.text, note.where)
        elif note.level is Level.DETAIL:
            self.detail(note.sentence)
        else:
            self.say(note.sentence)

    def show(self, answer: Answer, following: Sequence[Part] = ()) -> None:
        """The answer, as JSON or as tables and sentences; exit status 1 where it is bad.

        `following`: what to do next, which is no answer, and not said where only that is wanted.
        """
        _shown[-1].stop()
        if self.as_json:
            lines = [part.line for part in following if isinstance(part, Command)]
            data = answer.data | ({"next": lines} if lines else {})
            print(json.dumps(_finite(data), ensure_ascii=not is_unicode(sys.stdout)))
        else:
            self._print((*answer.parts, *(() if self.quiet else following)))
        if not answer.good:
            raise typer.Exit(1)

    def _print(self, parts: Sequence[Part]) -> None:
        with (out := self.out).capture() as printed:
            for before, part in zip([None, *parts], parts, strict=False):
                if isinstance(before, Table) or (before is not None and isinstance(part, Table)):
                    out.print()
                _print(out, part)
        print("\n".join(line.rstrip() for line in printed.get().splitlines()))

    @contextmanager
    def waiting(self, name: str) -> Iterator[None]:
        """Within it those who wait see what the command `name` does, until its answer."""
        shown = not self.quiet and self.progress
        on_terminal = _is_terminal(sys.stderr)
        made = OnTerminal(_console(sys.stderr)) if on_terminal else InLog(harmless)
        _shown.append(made if shown else Waiting())
        try:
            with _shown[-1].step(name, None):
                _shown[-1].start()
                yield
        finally:
            _shown.pop().stop()

    @contextmanager
    def live(self, title: str, total: int | None = None) -> Iterator[Line]:
        """A step: call what is yielded with a text, the count done, and that of all."""
        with _shown[-1].step(title, total) as line:
            yield line


# What those who wait see: of the command that runs, or nothing.
_shown: list[Waiting] = [Waiting()]


@contextmanager
def asking() -> Iterator[None]:
    """Within it a person is asked: nothing else is shown."""
    _shown[-1].stop()
    try:
        yield
    finally:
        _shown[-1].start()


def _messages() -> Console:
    _shown[-1].spoken()
    return _shown[-1].console or _console(sys.stderr)


class _Console(Console):
    """Prints no characters of control but its own."""

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        """Segments whose text a terminal only shows; none grows, so that columns stay."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else harmless(text), style, control)


def harmless(text: str) -> str:
    """A text that a terminal only shows."""
    return text.translate(_OBEYED)


def _print(out: Console, part: Part) -> None:
    """A sentence, a command, or a table under a title that may be wider than its columns."""
    if isinstance(part, Table):
        if part.title:
            _print_words(out, part.title, "bold")
        for number, each in enumerate(rendered(part, out.width)):
            if number:
                out.print()
            out.print(each)
    elif isinstance(part, Command):
        out.print(copyable(f"  {part.line}", out.width), soft_wrap=True)
    else:
        _print_words(out, part)


def _print_words(out: Console, words: str, style: str | None = None) -> None:
    """Text that wraps at its spaces."""
    out.print(wrapped(words, out.width), style=style, soft_wrap=True)


def _is_terminal(file: TextIO) -> bool:
    return file.isatty() and os.environ.get("TERM") != "dumb"


def is_unicode(file: TextIO) -> bool:
    """Whether every character can be written; JSON has another way to say those that cannot."""
    return (file.encoding or "utf-8").lower().startswith("utf")


def _console(file: TextIO) -> Console:
    """As wide as the terminal, or as COLUMNS says; elsewhere plain, with rows in one line each.

    Brackets are what they are, units in headers among them, and no markup. With NO_COLOR there is
    neither colour nor bold.
    """
    columns = os.environ.get("COLUMNS", "")
    width = int(columns) if columns.isdecimal() and int(columns) else None
    if width is None and not file.isatty():
        width = _WHOLE_ROWS
    plain = bool(os.environ.get("NO_COLOR")) or not _is_terminal(file)
    return _Console(
        file=file,
        highlight=False,
        markup=False,
        emoji=False,
        width=width,
        color_system=None if plain else "auto",
    )


def _finite(value: Any) -> Any:
    """JSON has no infinities: they become null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value


@contextmanager
def told_warnings() -> Iterator[None]:
    """Within it, warnings of ours are messages like all others."""
    with warnings.catch_warnings():
        otherwise = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *where: Any) -> None:
            if not issubclass(category, ExciteWarning):
                otherwise(message, category, *where)
            elif not {"--quiet", "-q"} & set(sys.argv):
                tell_message(f"warning: {message}")

        warnings.showwarning = show  # type: ignore[assignment]
        yield


def tell_message(message: str) -> None:
    """On stderr; the first word of an error is red on a terminal."""
    out = _messages()
    text = Text(wrapped(message, out.width) if out.is_terminal else message)
    text.highlight_regex("^error:", "bold red")
    out.print(text, soft_wrap=True)
