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


class _Steady(io.TextIOWrapper):
    """Text to a descriptor, as long as that works; then to nowhere, if the error is `given_up`.

    Only the buffers of Python itself know what was written: an interrupt at any instant neither
    loses a line nor writes it twice.
    """

    def __init__(self, stream: Any, given_up: Callable[[OSError], bool]) -> None:
        file = io.FileIO(stream.fileno(), "w", closefd=False)
        super().__init__(
            io.BufferedWriter(file),
            encoding=stream.encoding,
            errors="replace",
            line_buffering=stream.line_buffering,
        )
        self._given_up = given_up

    def write(self, text: str) -> int:
        """Take all of the text."""
        try:
            return super().write(text)
        except OSError as error:
            self._give_up(error)
            return len(text)

    def flush(self) -> None:
        """Write what is buffered."""
        try:
            super().flush()
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        if not self._given_up(error):
            raise error
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())
        os.close(nowhere)
        super().flush()


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
        return _Steady(stream, given_up)
    except (OSError, ValueError):  # it is kept in memory
        return stream
