"""What a command does, for those who wait: a line that changes on a terminal, lines in a log."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from rich.console import Console
from rich.progress import (
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column
from rich.text import Text

_FIRST, _AGAIN = 2.0, 10.0  # seconds without a word in a log: of a command, and later
_LOOK = 0.2  # seconds between looks


class Line(Protocol):
    """A progress line: a text, how much is done, and how much there is, once that is known."""

    def __call__(self, text: str, done: int, total: int | None = None) -> None:
        """Show it."""


class Waiting:
    """What a command is doing now; shown by those below, and here by nobody."""

    console: Console | None = None  # the one that can print a message above the line

    def __init__(self) -> None:
        self._now: dict[str, Any] = {}
        self._set(title="", text="", done=0, total=None)

    @contextmanager
    def step(self, title: str, total: int | None) -> Iterator[Line]:
        """A step of the command; once it is over, the line no longer tells of it."""
        before = self._now["title"]
        self._set(title=title, text="", done=0, total=total)

        def show(text: str, done: int, total: int | None = None) -> None:
            self._set(text=text, done=done, total=total or self._now["total"])

        try:
            yield show
        finally:
            self._set(title=before, text="finishing", done=0, total=None)

    def begin(self, text: str, title: str) -> None:
        """What begins, in this step of the command, or under a `title` as the next one."""
        new = {"title": title, "total": None} if title else {}
        self._set(text=text, done=0, **new)

    def spoken(self) -> None:
        """A message was printed."""

    def start(self) -> None:
        """Show it."""

    def stop(self) -> None:
        """Show it no longer."""

    def _set(self, **new: Any) -> None:
        if new["done"] < self._now.get("done", 1) or "title" in new:  # counts from zero again
            new["began"] = time.monotonic()
        self._now = self._now | new


class InLog(Waiting):
    """Prints a line where nothing was printed for some seconds."""

    def __init__(self, clean: Callable[[str], str]) -> None:
        super().__init__()
        self._clean, self._over = clean, threading.Event()
        self._thread = threading.Thread(target=self._print, daemon=True)
        self._began = self._last = time.monotonic()
        self._due = _FIRST

    def spoken(self) -> None:
        """The next line is not needed soon."""
        self._last, self._due = time.monotonic(), _AGAIN

    def start(self) -> None:
        """Show it."""
        self._over.clear()
        self._thread = threading.Thread(target=self._print, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Show it no longer."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()

    def _print(self) -> None:
        while not self._over.wait(_LOOK):
            if time.monotonic() - self._last >= self._due:
                self.spoken()
                print(self._clean(self.words(time.monotonic())), file=sys.stderr, flush=True)

    def words(self, now: float) -> str:
        """`drawing: frame 12/60; 10 s so far, 40 s more at most`."""
        step = self._now
        what = ": ".join(filter(None, (step["title"], step["text"] or "preparing")))
        time_left = ""
        if step["total"] and 0 < step["done"] < step["total"]:
            left = (now - step["began"]) * (step["total"] / step["done"] - 1.0)
            time_left = f", {left:.0f} s more at most"
        return f"{what}; {now - self._began:.0f} s so far{time_left}"


class OnTerminal(Waiting):
    """A line at the bottom that changes, and goes."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self.console = console
        columns: list[ProgressColumn] = [SpinnerColumn()]
        columns += [TextColumn("{task.fields[text]}", table_column=Column(overflow="fold"))]
        self._bar = Progress(
            *columns,
            _Remaining(),
            console=console,
            transient=True,
            redirect_stdout=False,  # in place of these nothing knows whether it is a terminal
            redirect_stderr=False,
        )
        self._task = self._bar.add_task("", total=None, text="")

    def start(self) -> None:
        """Show it."""
        self._bar.start()

    def stop(self) -> None:
        """Show it no longer."""
        self._bar.stop()

    def _set(self, **new: Any) -> None:
        before = self._now.get("done", 0)
        super()._set(**new)
        if hasattr(self, "_bar"):
            if self._now["done"] < before or "title" in new:
                self._bar.reset(self._task)
            words = "  ".join(filter(None, (self._now["title"], self._now["text"])))
            done, total = self._now["done"], self._now["total"]
            self._bar.update(self._task, completed=done, total=total, text=words)


class _Remaining(TimeRemainingColumn):
    """The time that all steps need; the time that has passed until that is known."""

    max_refresh = 0.0  # a step that begins has no time of the one before

    def render(self, task: Task) -> Text:
        """`≤ 0:00:12`, or `0:00:03`."""
        if task.time_remaining is None:
            return TimeElapsedColumn().render(task)
        return Text.assemble("≤ ", super().render(task))
