"""People carry files by hand: a motion is laid out, and its log awaited.

A log is taken that is newer than its motion, is written no more, and is a whole log of the motion.
Any other stays where it is; the reason is said, and it is looked at again once it changes.
"""

import fcntl
import json
import os
import shutil
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from excite_cli.atomic import write_atomically, write_text_atomically
from excite_cli.campaign.measure import Measure, Take
from excite_cli.campaign.same_motion import digest_of, record_measured
from excite_cli.claim import claim, leave
from excite_cli.errors import refusal

# Whether somebody is still writing a file.


def is_being_written(path: Path) -> bool:
    """Whether a process of this machine has `path` open for writing, however long it pauses.

    Linux gives a read lease of a file only where nothing has it open for writing; the lease is
    given back at once. False where nothing can be said: other systems, other machines that write
    through a network file system, files of other users.
    """
    with suppress(OSError, AttributeError):
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            # Should somebody open it just then, the signal is one that does nothing.
            fcntl.fcntl(handle, fcntl.F_SETSIG, signal.SIGURG)
            fcntl.fcntl(handle, fcntl.F_SETLEASE, fcntl.F_RDLCK)
            fcntl.fcntl(handle, fcntl.F_SETLEASE, fcntl.F_UNLCK)
        except BlockingIOError:
            return True
        finally:
            os.close(handle)
    return False


_POLL = 0.5  # s
_STILL = 5.0  # s that a file's size and time have not changed: a copy pauses for less


@dataclass(frozen=True)
class Inbox(Measure):
    """Lays NAME.csv into `folder` and waits for NAME_log and any of the suffixes of logs.

    `tell` hears what is awaited, and why a file is not taken.
    """

    folder: Path
    tell: Callable[[str], None]
    suffix: str = ".csv"

    def take(self, take: Take) -> None:
        """Wait until a log of the motion is there, and copy it.

        Raises
        ------
        FileError
            Another campaign waits for the log of a motion of this name; the folder cannot be
            written to.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        laid = self.folder / f"{take.name}.csv"
        claim(laid)
        try:
            since = _laid_out(take, laid)
            log = self.folder / f"{take.name}_log{self.suffix}"
            self.tell(f"play {laid} ({take.seconds:.0f} s) and put its log there as {log.name}")
            seen: _State | None = None
            while True:
                seen = _once_still(log, seen)
                why = _refused(take, log, seen, since)
                if not why:
                    break
                self.tell(f"{why} It is looked at again once it changes.")
            record_measured(take.data)
            # It was read: what is laid there next under this name is another take.
            log.rename(_fresh(log.with_name(f"{log.stem}.read{log.suffix}")))
            _confirmation(log).unlink(missing_ok=True)
        finally:
            leave(laid)


@dataclass(frozen=True)
class _State:
    """Of a log: size, date, last change of any kind, and when its date was confirmed [ns]."""

    size: int
    date: int
    changed: int
    confirmed: int

    @classmethod
    def of(cls, log: Path) -> "_State | None":
        """None if there is no such file."""
        try:
            status, confirmed = log.stat(), 0
        except OSError:
            return None
        with suppress(OSError):
            confirmed = _confirmation(log).stat().st_mtime_ns
        found = cls(status.st_size, status.st_mtime_ns, status.st_ctime_ns, confirmed)
        return found if log.is_file() else None


def _confirmation(log: Path) -> Path:
    """The empty file that says: this is a log of its motion, whatever its date is."""
    return log.with_name(log.name + ".ok")


def _laid_out(take: Take, laid: Path) -> int:
    """Lay the motion out; since when it is there [ns], for a resumed campaign the first time."""
    record = take.data.with_name(f"{take.data.stem}.laid.json")
    motion = digest_of(take.motion)
    since = 0
    with suppress(OSError, ValueError, KeyError, TypeError):
        known = json.loads(record.read_bytes())
        since = int(known["since"]) if known["motion"] == motion else 0
    if not since or not laid.is_file() or digest_of(laid) != motion:
        _copy(take.motion, laid)
    if not since:
        since = laid.stat().st_mtime_ns
        text = json.dumps({"motion": motion, "since": since})
        write_text_atomically(record, text + "\n")
    return since


def _once_still(log: Path, refused: _State | None) -> _State:
    """Wait until `log` is another than the one that was refused, and is written no more."""
    seen, since = None, time.monotonic()
    while True:
        now = _State.of(log)
        if now != seen or is_being_written(log):
            seen, since = now, time.monotonic()
        elif now is not None and now.size and now != refused and time.monotonic() - since >= _STILL:
            return now
        time.sleep(_POLL)


def _refused(take: Take, log: Path, state: _State, since: int) -> str:
    """Why the log is not taken; if it is, it has been copied to `take.data`."""
    sure = state.confirmed >= since
    replace = "Put the log of this motion in its place."
    confirm = f"{replace} If it is that and a clock was wrong, say so: touch {_confirmation(log)}"
    if state.date < since and not sure:
        return (
            f"{log} is of {_date(state.date)}, and its motion was laid out at {_date(since)}: an "
            f"older log is none of this motion, and is not taken. {confirm}."
        )
    try:
        log.open("rb").close()
    except OSError as error:
        return f"{log} cannot be read: {refusal(error)}"
    _copy(log, take.data)
    if _State.of(log) != state:
        return f"{log} has changed while it was read."
    why = take.refused(take.data, None if sure else since * 1e-9)
    if not why:
        return ""
    dated = not sure and not take.refused(take.data, None)
    take.data.unlink()
    return f"{log} is not taken: {why} {f'{confirm}.' if dated else replace}"


def _fresh(path: Path) -> Path:
    """`path`, or with _2, _3 … before its suffix where that is taken: nothing is replaced."""
    number, to = 2, path
    while to.exists():
        to = path.with_name(f"{path.stem}_{number}{path.suffix}")
        number += 1
    return to


def _date(nanoseconds: int) -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(nanoseconds * 1e-9))


def _copy(source: Path, target: Path) -> None:
    write_atomically(target, lambda temporary: shutil.copyfile(source, temporary))
