"""How processes are ended: SIGTERM first, SIGKILL after a while, or at once when asked again."""

import signal
import time
from collections.abc import Callable, Sequence
from math import inf

from excite_cli.campaign.processes import Process, send_to_all

_KILLED = 2.0  # s after SIGKILL: what still runs then waits for hardware, or is another user's


class Escalation:
    """Ends all that `find` gives, `group` among them, in two stages.

    Each `request` begins the next stage; without a second one it begins after `grace` [s].
    Nothing happens but in `request` and `step`, which is to be called every now and then.
    """

    def __init__(self, find: Callable[[], Sequence[Process]], group: int, grace: float) -> None:
        self._find, self._group, self._grace = find, group, grace
        self._due = inf
        self.stage = 0

    def request(self) -> None:
        """SIGTERM to all that run now; the second time, SIGKILL, also to what is started then."""
        if self.stage == 0:
            self.stage, self._due = 1, time.monotonic() + self._grace
            found = self._find()
            for number in (signal.SIGTERM, signal.SIGCONT):  # one that is stopped hears nothing
                send_to_all(found, self._group, number)
        elif self.stage == 1:
            self.stage, self._due = 2, time.monotonic() + _KILLED
            self.step()

    def step(self) -> None:
        """Go on: SIGKILL once the grace is over, and again as long as something runs."""
        if self.stage == 1 and time.monotonic() >= self._due:
            self.request()
        elif self.stage == 2:
            send_to_all(self._find(), self._group, signal.SIGKILL)

    @property
    def in_vain(self) -> bool:
        """Whether SIGKILL has had its time."""
        return self.stage == 2 and time.monotonic() >= self._due
