"""The program called in this process, as nearly like a process of its own as can be.

Arguments, folder, environment, standard streams (as files, so that what C++ prints is captured
too), warnings, log handlers, handlers of signals, threads of the linear algebra, the path of
imports and modules imported from the folder are the call's own, and put back after it.
"""

import ctypes
import logging
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, chdir, contextmanager
from pathlib import Path
from subprocess import CompletedProcess
from types import FrameType
from typing import Any, TextIO
from unittest.mock import patch

from threadpoolctl import threadpool_limits

_STANDARD = ("stdin", "stdout", "stderr")
_HEEDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)


class TooLong(BaseException):
    """A call had no end; no `except Exception` of the program may take it for its own."""


def call(
    arguments: list[str], folder: Path, environment: dict[str, str], patience: float
) -> CompletedProcess[str]:
    """`excite` with `arguments`: its exit status and what it printed.

    Raises
    ------
    TooLong
        It took longer than `patience` seconds.
    """
    from excite_cli.cli.app import main

    command = ["excite", *arguments]
    with ExitStack() as stack:
        files = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(2)]
        # The streams come last and go first, so that whatever else fails is seen. Without pytest's
        # handlers Python's own prints warnings of logs, as in the program.
        with (
            chdir(folder),
            patch.dict(os.environ, environment, clear=True),
            patch.object(logging.getLogger(), "handlers", []),
            patch.object(sys, "argv", command),
            _signals(),
            _alarm(patience),
            threadpool_limits(limits=1),
            _imports(folder),
            _streams(files),
            _warnings(),
        ):
            status = _status(main)
        told = []
        for file in files:
            file.seek(0)
            told.append(file.read().decode(errors="replace"))
    return CompletedProcess(command, status, *told)


def _status(main: Callable[[], None]) -> int:
    """The exit status that Python would end with."""
    try:
        main()
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return (end.code or 0) & 0xFF
        print(end.code, file=sys.stderr)
        return 1
    except Exception:
        traceback.print_exc()
        return 1
    return 0


@contextmanager
def _signals() -> Iterator[None]:
    before = {each: signal.getsignal(each) for each in _HEEDED}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def _alarm(patience: float) -> Iterator[None]:
    def ring(number: int, frame: FrameType | None) -> None:
        raise TooLong(f"no end after {patience:g} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, patience)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _imports(folder: Path) -> Iterator[None]:
    before, path = set(sys.modules), list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None)
            if file is not None and Path(file).is_relative_to(folder):
                del sys.modules[name]


@contextmanager
def _warnings() -> Iterator[None]:
    """Python's own filters, not pytest's; what passes them is printed."""

    def show(message: Any, category: Any, file: str, line: int, *others: Any) -> None:
        sys.stderr.write(warnings.formatwarning(message, category, file, line))

    with warnings.catch_warnings():
        warnings.resetwarnings()
        for category in (
            DeprecationWarning,
            PendingDeprecationWarning,
            ImportWarning,
            ResourceWarning,
        ):
            warnings.simplefilter("ignore", category)
        warnings.showwarning = show
        yield


@contextmanager
def _streams(files: list[Any]) -> Iterator[None]:
    """Standard input empty, output and error into `files`, for Python and for C alike."""
    saved = {name: getattr(sys, name) for name in _STANDARD}
    _flush()
    kept = [os.dup(number) for number in range(3)]
    with open(os.devnull, "rb") as nothing:
        for number, file in enumerate([nothing, *files]):
            os.dup2(file.fileno(), number)
    try:
        for number, name in enumerate(_STANDARD):
            setattr(sys, name, _text(number))
        yield
    finally:
        _flush()
        for number, name in enumerate(_STANDARD):
            setattr(sys, name, saved[name])
            os.dup2(kept[number], number)
            os.close(kept[number])


def _text(number: int) -> TextIO:
    return open(number, "w" if number else "r", encoding="utf-8", closefd=False)


def _flush() -> None:
    """What Python and C have not written yet."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and not stream.closed:
            stream.flush()
    ctypes.CDLL(None).fflush(None)
