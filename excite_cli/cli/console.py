"""What a command says: tables and messages, progress, JSON, exit statuses.

stdout is the answer (a table, or JSON with `--json`), stderr is progress and messages.
"""

import json
import math
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from excite_cli.errors import ExciteError

BUG, INTERRUPTED = 70, 130
PLAIN_WIDTH = 140


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
        return _console(sys.stderr)

    def say(self, text: str) -> None:
        """A message for people, unless quiet."""
        if not self.quiet:
            self.err.print(text)

    def detail(self, text: str) -> None:
        """A message for those who asked for more."""
        if self.verbose:
            self.err.print(text)

    def answer(self, table: Table | str | Sequence[Table | str], data: dict[str, Any]) -> None:
        """The answer: JSON, or tables and sentences."""
        if self.as_json:
            print(json.dumps(_finite(data), ensure_ascii=False))
            return
        if self.quiet:
            return
        for part in [table] if isinstance(table, Table | str) else table:
            self.out.print(part)

    @contextmanager
    def live(self, title: str, total: int | None = None) -> Iterator[Callable[[str, int], None]]:
        """A progress line; call the yielded function with a text and the count done."""
        if self.quiet or not self.progress:
            yield lambda text, done: None
            return
        if not sys.stderr.isatty():
            yield _sparse(title)
            return
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}"),
            TextColumn("{task.fields[text]}"),
            TimeElapsedColumn(),
        )
        with Progress(*columns, console=self.err, transient=True) as bar:
            task = bar.add_task(title, total=total, text="")
            yield lambda text, done: bar.update(task, completed=done, text=text)


def _console(file: TextIO) -> Console:
    """Coloured and as wide as the terminal; plain and wide enough for our tables elsewhere.

    Brackets are what they are, units in headers among them, and no markup.
    """
    width = None if file.isatty() else PLAIN_WIDTH
    return Console(file=file, highlight=False, markup=False, width=width)


def _sparse(title: str) -> Callable[[str, int], None]:
    """Progress for logs: a line every few seconds."""
    import time

    last = time.monotonic()

    def tell(text: str, done: int) -> None:
        nonlocal last
        if time.monotonic() - last >= 5.0:
            last = time.monotonic()
            print(f"{title}  {text}", file=sys.stderr, flush=True)

    return tell


def _finite(value: Any) -> Any:
    """JSON has no infinities: they become null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value


def run_guarded(action: Callable[[], None]) -> int:
    """Run a command; return its exit status, with one message instead of a traceback."""
    try:
        action()
    except ExciteError as error:
        print(f"excite: {error}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        print("excite: interrupted; every finished motion is in the file.", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except MemoryError:
        print("excite: out of memory; take fewer samples, harmonics or joints.", file=sys.stderr)
        return 2
    except Exception as error:
        if {"--verbose", "-v"} & set(sys.argv):
            traceback.print_exc()
        print(
            f"excite: internal error ({type(error).__name__}: {error}). This is a bug of the "
            "program. Run again with --verbose and report what it prints.",
            file=sys.stderr,
        )
        return BUG
    return 0
