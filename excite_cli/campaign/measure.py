"""Who has a motion measured: a program, people who carry files, or a simulated robot."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from excite_cli.errors import ExciteError
from excite_cli.shown.note import readable


class NotMeasuredError(ExciteError):
    """A motion was not measured; the campaign can be gone on with."""

    exit_status = 1


class StillRunningError(NotMeasuredError):
    """Something that may move the robot could not be ended; nothing else is played."""


@readable
def _nothing_refused(log: Path, since: float | None) -> str:
    return ""


@dataclass(frozen=True)
class Take:
    """One motion to be measured.

    `motion`: CSV of t, q, v, a, from rest to rest; `data`: where its log is to be written;
    `seconds`: how long the motion is; `diary`: where what a program says is kept. `refused(log,
    since)`: why a file is no log of the motion, empty where it is one; with `since` [s from 1970],
    also where its own time stamps say that it ended before.
    """

    name: str
    motion: Path
    data: Path
    seconds: float
    diary: Path
    refused: Callable[[Path, float | None], str] = _nothing_refused


class Measure(ABC):
    """A way to have motions measured."""

    suffix: str  # of the logs

    def wait_for_earlier(self, take: Take) -> None:  # noqa: B027
        """Wait for what a campaign that was killed has left at work on this take."""

    @abstractmethod
    def take(self, take: Take) -> None:
        """Have `take.motion` played, and its log written to `take.data`: whole, on return.

        Raises
        ------
        NotMeasuredError
            There is no log, and why.
        """
