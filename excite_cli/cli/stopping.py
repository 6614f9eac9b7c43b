"""How a command is stopped from outside: Ctrl-C, SIGTERM, a terminal that closes.

All end as Ctrl-C does, so that temporary files and claims are removed on the way out.
"""

import os
import signal
from collections.abc import Sequence
from types import FrameType

_RESUMED = {
    "optimize": "interrupted; what was found so far is in the file: see --resume.",
    "campaign": "interrupted; all that was measured is in the folder: see --resume.",
    "study": "interrupted; every finished case is in the folder: see --resume.",
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
