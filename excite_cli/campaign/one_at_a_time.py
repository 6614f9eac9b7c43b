"""One program at a time moves the robot, even after the campaign that started it was killed.

Three things say that one still runs. Its supervisor holds a lock (on an open file, so that it lasts
as long as the supervisor, whatever became of the campaign), and so does the program. Its processes
have a mark in their environment. The lock's file names its session, and when that began.
"""

import fcntl
import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from excite_cli.campaign.measure import StillRunningError
from excite_cli.campaign.process_table import Process, boot, in_words, marked, of_session
from excite_cli.errors import FileError, refusal
from excite_cli.shown.note import Level, Note, Tell

_LOCK = ".moving.lock"
_POLL = 0.2  # s
_SAID = 1.0  # s of waiting after which a person wants to know why


@contextmanager
def held_while_it_runs(folder: Path, patience: float, tell: Tell) -> Iterator[int]:
    """A descriptor for a program to inherit; waits for one of before that still runs.

    Raises
    ------
    StillRunningError
        A program of before still runs after `patience` [s].
    """
    path = folder / _LOCK
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {refusal(error)}") from error
    try:
        _wait_until_free(handle, folder, patience, tell)
        yield handle
    finally:
        os.close(handle)


def left_in(folder: Path) -> list[Process]:
    """What runs of programs that record into `folder`, as far as it can be found."""
    found = {each.pid: each for each in marked(folder)}
    session, start = _noted(folder)
    if session:
        found.update((each.pid, each) for each in of_session(session, start))
    return list(found.values())


def session_of(folder: Path) -> int:
    """The session, and group, of the program that was started last; 0 where it is not known."""
    return _noted(folder)[0]


def _noted(folder: Path) -> tuple[int, int]:
    """Session and its start as the supervisor noted them since the last boot; else 0, 0."""
    try:
        found = json.loads((folder / _LOCK).read_bytes())
        if found["boot"] and found["boot"] == boot():
            return int(found["session"]), int(found["start"])
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return 0, 0


def _wait_until_free(handle: int, folder: Path, patience: float, tell: Tell) -> None:
    begun, said = time.monotonic(), False
    while not _locked(handle) or left_in(folder):
        waited = time.monotonic() - begun
        if waited > patience:
            raise StillRunningError(
                f"still running: {_who(folder)}, of an earlier run of this campaign. The robot may "
                "move: stop it by hand, then go on with --resume."
            )
        if waited > _SAID and not said:
            said = True
            text = f"still running: {_who(folder)}, of an earlier run of this campaign"
            tell(Note(Level.WARNING, f"{text}. Nothing is played before that has ended."))
        time.sleep(_POLL)


def _who(folder: Path) -> str:
    """Processes in words, or that there is one that cannot be seen from here."""
    return in_words(left_in(folder)) or (
        f"a program that cannot be seen from here, as {folder / _LOCK} is locked (by another user "
        "or machine?)"
    )


def _locked(handle: int) -> bool:
    """Whether the lock is ours; where the file system has none, nothing can be said: it is."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
