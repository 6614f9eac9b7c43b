"""How a command is stopped from outside: Ctrl-C, SIGTERM, a terminal that closes.

All end as Ctrl-C does, so that temporary files and claims are removed on the way out.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

# Ctrl-C asks for the answer so far; once more, and the command ends as any other does.


@contextmanager
def answer_so_far(tell: Callable[[], None]) -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C was pressed: the first time it is reported, the second time it interrupts.

    Signals are the main thread's: in any other thread none is seen.
    """
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True
        tell()

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


_RESUMED = {
    "optimize": "interrupted; what was found so far is in the file: see --resume.",
    "campaign": "interrupted; all that was measured is in the folder: see --resume.",
    "study": "interrupted; every finished case is in the folder: see --resume.",
    "selftest": "interrupted; every finished case is in the folder, if -o names one: see --resume.",
}
_last = signal.SIGINT


def heed_signals() -> None:
    """Let SIGTERM and SIGHUP (unless ignored, as `nohup` does) interrupt this process."""
    for each in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(each) is signal.SIG_DFL:
            signal.signal(each, _stop)


def stopped(arguments: Sequence[str]) -> tuple[int, str]:
    """Exit status, and one message for the command line `arguments`."""
    command = next((each for each in arguments if not each.startswith("-")), "")
    return 128 + _last, _RESUMED.get(command, "interrupted; no file is half-written.")


def _stop(number: int, frame: FrameType | None) -> None:
    global _last
    _last = signal.Signals(number)
    raise KeyboardInterrupt


def _as_usual() -> None:
    """In a forked child: a pool ends its workers by SIGTERM, and they need no way out."""
    for each in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(each) is _stop:
            signal.signal(each, signal.SIG_DFL)


os.register_at_fork(after_in_child=_as_usual)
