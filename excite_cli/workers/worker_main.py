"""What a worker does, and the process of one: it takes tasks, one at a time, until its parent ends.

The process and its parent talk over a socket: its end tells either that the other one is gone.
"""

import ctypes
import os
import pickle
import select
import signal
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from excite_cli.errors import ExciteError
from excite_cli.out_of_core import Spool
from excite_cli.workers.base import Answer, Tell, packed

_EVERY = 0.2  # s: words of a task are passed on so often at most
_FULL = 2**28  # bytes of a file with answers
# Memory that a worker frees stays with it: its next arrays need no cleared pages.
_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # options of glibc's mallopt
_KEPT, _LARGEST = 128 * 2**20, 32 * 2**20  # bytes; the second is the greatest that glibc takes


@cache
def _set_option(option: int, value: int) -> None:
    with suppress(AttributeError, OSError, TypeError):  # another C library than glibc
        ctypes.CDLL(None).mallopt(option, value)


def keep_memory() -> None:
    """Let this process keep what it frees, up to 128 MB.

    glibc returns large arrays to the system one by one. A worker of `diagnose` spent a twentieth
    of its time on the pages of those that came next; dask's workers, which are started with
    MALLOC_TRIM_THRESHOLD_=65536, take half as long again for the small arrays of a start.
    """
    _set_option(_TRIM_THRESHOLD, _KEPT)
    _set_option(_MMAP_THRESHOLD, _LARGEST)


def share_heap() -> None:
    """Let the threads that come share the heap of this process.

    With heaps of their own, those that read answers kept 30 of 265 MB of a command.
    """
    _set_option(_ARENA_MAX, 1)


# What a thread has unpickled last and its digest: threads of a worker must not share a problem.
_held = threading.local()


def outcome(key: str, shared: Any, job: bytes, tell: Tell) -> Answer:
    """Do the task of the pickle `job`, (function, task); `shared` is another, with digest `key`.

    What is shared is read with the first task that needs it: if that fails, it is reported.
    """
    try:
        if getattr(_held, "key", None) != key:
            _held.key = _held.value = None
            _held.value = pickle.loads(shared)
            _held.key = key
        function, task = pickle.loads(job)
        return "done", function(_held.value, task, tell)
    except Exception as error:  # all of them are raised by the caller
        return "failed", able_to_travel(error)


def able_to_travel(error: Exception) -> Exception:
    """The error itself with its traceback as a note, or the nearest that can be pickled.

    An exception whose constructor wants more than its message does not come back from a pickle;
    then its first base class that does is taken, with the same message.
    """
    if not isinstance(error, ExciteError):
        error.add_note("In a worker:\n" + "".join(traceback.format_exception(error)))
    kinds: tuple[Any, ...] = (lambda text: error, *type(error).__mro__)
    for kind in kinds:
        with suppress(Exception):  # whatever a foreign exception does when it is pickled
            candidate = kind(str(error))
            candidate.__dict__.update(__notes__=getattr(error, "__notes__", []))
            back = pickle.loads(pickle.dumps(candidate))
            if isinstance(back, Exception) and str(back) == str(error):
                return candidate
    return RuntimeError(f"{type(error).__name__}: {error}")


def serve(descriptor: int, modules: Sequence[str] = ()) -> None:
    """Do tasks that come over the socket `descriptor`.

    `modules` are what the parent had imported: most of the time that the first task would take.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is asked, and ends its workers
    keep_memory()
    connection = Connection(descriptor)
    threading.Thread(target=_end_with_parent, args=(descriptor,), daemon=True).start()
    spool = Spool(0)
    try:
        connection.send(("ready", None))
        for name in modules:
            with suppress(Exception):  # whoever needs it meets that again
                import_module(name)
        while True:
            key, shared, job = pickle.loads(connection.recv_bytes())
            # The parent has read the last answer by now; so a full file is its alone.
            spool = spool if spool.size < _FULL else Spool(0)
            answer = outcome(key, shared, job, _teller(connection))
            connection.send_bytes(_sendable(answer, spool))
    except (EOFError, OSError):
        os._exit(0)  # the parent is gone


def _sendable(answer: Answer, spool: Spool) -> bytes:
    """The message of an answer, large arrays of it in `spool`."""
    try:
        return packed(answer, spool)
    except Exception as error:
        return pickle.dumps(("failed", able_to_travel(error)))


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
