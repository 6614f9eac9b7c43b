"""The process of one worker: takes tasks from its parent, one at a time, until that is gone.

A program of its own instead of multiprocessing's, which runs the caller's main module again in
every child. The two talk over a socket: its end tells either side that the other one is gone.
"""

import ctypes
import os
import pickle
import select
import signal
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from excite_cli.out_of_core import Spool
from excite_cli.workers.base import Tell, able_to_travel, packed

# Memory that a worker frees stays with it: its next arrays need no cleared pages.

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # options of glibc's mallopt
_KEPT, _LARGEST = 128 * 2**20, 32 * 2**20  # bytes; the second is the greatest that glibc takes


@cache
def keep_memory() -> None:
    """Let this process keep what it frees, up to 128 MB, once.

    glibc returns large arrays to the system one by one. A worker of `diagnose` spent a twentieth
    of its time on the pages of those that came next; dask's workers, which are started with
    MALLOC_TRIM_THRESHOLD_=65536, take half as long again for the small arrays of a start.
    """
    try:
        set_option = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library than glibc
        return
    set_option(_TRIM_THRESHOLD, _KEPT)
    set_option(_MMAP_THRESHOLD, _LARGEST)


# Words of a task are passed on this often at most [s].
_EVERY = 0.2
_FULL = 2**28  # bytes of a file with answers


def serve(descriptor: int, threads: int, modules: Sequence[str] = ()) -> None:
    """Do tasks that come over the socket `descriptor`; linear algebra uses `threads`.

    `modules` are what the parent had imported: most of the time that the first task would take.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is asked, and ends its workers
    keep_memory()
    connection = Connection(descriptor)
    threading.Thread(target=_end_with_parent, args=(descriptor,), daemon=True).start()
    shared, spool = _Shared(), Spool(0)
    try:
        connection.send(("ready", os.getpid()))
        for name in modules:
            with suppress(Exception):  # whoever needs it meets that again
                import_module(name)
        while True:
            kind, body = connection.recv()
            if kind == "shared":
                shared = _Shared(body)
            else:
                # The parent has read the last answer by now; so a full file is its alone.
                spool = spool if spool.size < _FULL else Spool(0)
                answer, _held = _answer(shared, body, threads, _teller(connection), spool)
                connection.send_bytes(answer)
    except (EOFError, OSError):
        os._exit(0)  # the parent is gone


class _Shared:
    """What all tasks share, unpickled with the first of them: if it fails, that is reported."""

    def __init__(self, body: bytes = b"") -> None:
        self._body, self._value, self._ready = body, None, False

    def value(self, threads: int) -> Any:
        if not self._ready:
            from threadpoolctl import threadpool_limits

            self._value, self._ready = pickle.loads(self._body), True
            self._body = b""
            # Libraries came with it; those that come later see the variables of the environment.
            threadpool_limits(limits=threads)
        return self._value


def _answer(
    shared: _Shared, body: bytes, threads: int, tell: Tell, spool: Spool
) -> tuple[bytes, Any]:
    """The message with what the task of `body` gives, and that; large arrays of it in `spool`."""
    try:
        value = shared.value(threads)
        function, task = pickle.loads(body)
        found = function(value, task, tell)
        return packed(("done", found), spool), found
    except Exception as error:  # all of them are raised by the caller
        return pickle.dumps(("failed", able_to_travel(error))), None


def _teller(connection: Connection) -> Tell:
    last = -_EVERY

    def tell(word: Any) -> None:
        nonlocal last
        if time.monotonic() - last >= _EVERY:
            last = time.monotonic()
            connection.send(("told", word))

    return tell


def _end_with_parent(descriptor: int) -> None:
    """End this process, whatever it is doing, when the other end of the socket is closed."""
    watched = select.poll()
    watched.register(descriptor, 0)  # nothing but hang-up and errors
    watched.poll()
    os._exit(0)
