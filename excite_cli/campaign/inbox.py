"""People carry files by hand: a motion is laid out, and its log awaited."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from excite_cli.atomic import write_atomically
from excite_cli.campaign.measure import Measure, Take

_POLL = 0.5  # s
_STILL = 2.0  # s that a file's size and time have not changed: it is whole


@dataclass(frozen=True)
class Inbox(Measure):
    """Lays NAME.csv into `folder` and waits for NAME_log and any of the suffixes of logs.

    `tell` hears what is awaited.
    """

    folder: Path
    tell: Callable[[str], None]
    suffix: str = ".csv"

    def take(self, take: Take) -> None:
        """Wait until the log is there and grows no more, and copy it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        laid = self.folder / f"{take.name}.csv"
        _copy(take.motion, laid)
        log = self.folder / f"{take.name}_log{self.suffix}"
        self.tell(f"play {laid} ({take.seconds:.0f} s) and put its log there as {log.name}")
        seen: tuple[int, int] | None = None
        since = time.monotonic()
        while True:
            if log.is_file():
                status = log.stat()
                now = status.st_size, status.st_mtime_ns
                if now != seen:
                    seen, since = now, time.monotonic()
                elif status.st_size and time.monotonic() - since >= _STILL:
                    break
            time.sleep(_POLL)
        _copy(log, take.data)
        # It was read: what is laid there next under this name is another take.
        log.rename(log.with_name(f"{log.stem}.read{log.suffix}"))


def _copy(source: Path, target: Path) -> None:
    content = source.read_bytes()

    def write(path: Path) -> None:
        path.write_bytes(content)

    write_atomically(target, write)
