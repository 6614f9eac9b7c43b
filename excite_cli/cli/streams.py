"""Standard streams on which a program can rely, whatever it was started with.

A stream may be closed (`>&-`), end early (`| head -1`), be full, or know few characters (LANG=C).
None of it is a reason to lose a result: what cannot be encoded is replaced, and what nobody reads
is dropped. Only an answer that a disk has no room for is an error.
"""

import contextlib
import errno
import io
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any

_NOBODY_READS = (errno.EPIPE,)
_STANDARD = (0, 1, 2)


class _Steady(io.RawIOBase):
    """The descriptor of a stream, written to as long as that works."""

    def __init__(self, descriptor: int, given_up: Callable[[OSError], bool]) -> None:
        self._descriptor, self._given_up = descriptor, given_up

    def fileno(self) -> int:
        return self._descriptor

    def isatty(self) -> bool:
        return os.isatty(self._descriptor)

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        """All of `data`, as far as the caller knows."""
        try:
            return os.write(self._descriptor, data)
        except OSError as error:
            if not self._given_up(error):
                raise
            return len(memoryview(data).cast("B"))


@contextlib.contextmanager
def steady_streams() -> Iterator[None]:
    """Within it the standard streams can be used; at its end they are as before."""
    _fill_closed()
    before = sys.stdin, sys.stdout, sys.stderr
    if sys.stdin is None:
        sys.stdin = io.StringIO()
    sys.stdout = _steady(sys.stdout, lambda error: error.errno in _NOBODY_READS)
    sys.stderr = _steady(sys.stderr, lambda error: True)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # whoever needs the answer has flushed it
            sys.stdout.flush()
            sys.stderr.flush()
        sys.stdin, sys.stdout, sys.stderr = before


def _fill_closed() -> None:
    """No file of ours may become standard output because that number was free."""
    for descriptor in _STANDARD:
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


def _steady(stream: Any, given_up: Callable[[OSError], bool]) -> Any:
    """The stream, if it has a descriptor, so that writing a text to it always works."""
    if stream is None:
        return io.StringIO()
    try:
        descriptor = stream.fileno()
    except (OSError, ValueError):  # it is kept in memory
        return stream
    raw = _Steady(descriptor, given_up)
    return io.TextIOWrapper(
        io.BufferedWriter(raw),
        encoding=stream.encoding,
        errors="replace",
        line_buffering=stream.line_buffering,
    )
