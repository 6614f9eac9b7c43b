"""Signals that ask this process to end are counted, and delivered once something else has ended.

Raised at any instant, as Python does it for Ctrl-C, they would cut off whatever ends the robot's
program; and the second one would cut off what the first one began.
"""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_ASK_TO_END = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


class Held:
    """Signals that came: `count`, and which was the `first` (0: none did)."""

    count = 0
    first = 0

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.count += 1
        self.first = self.first or number

    def deliver(self) -> None:
        """Let the first signal do what it would have done, after `held_signals` has ended."""
        if not self.first:
            return
        handler = signal.getsignal(self.first)
        if callable(handler):
            handler(self.first, None)
        else:
            os.kill(os.getpid(), self.first)


@contextmanager
def held_signals() -> Iterator[Held]:
    """Count SIGINT, SIGTERM, SIGHUP and SIGQUIT, but for those that are ignored.

    Only the main thread hears signals: in another one nothing is held, and nothing needs to be.
    """
    held = Held()
    before = {each: signal.getsignal(each) for each in _ASK_TO_END}
    mine = [each for each, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    try:
        for each in mine:
            signal.signal(each, held._note)
    except ValueError:
        mine = []
    try:
        yield held
    finally:
        if mine:
            signal.pthread_sigmask(signal.SIG_BLOCK, mine)
            for each in mine:
                signal.signal(each, before[each])
            signal.pthread_sigmask(signal.SIG_UNBLOCK, mine)
