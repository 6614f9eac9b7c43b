"""One program at a time moves the robot, even after the campaign that started it was killed.

The lock is on an open file that the program inherits: it lasts as long as the program, or anything
that it started, whatever became of the campaign.
"""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from excite_cli.campaign.measure import NotMeasuredError
from excite_cli.errors import FileError, refusal

_LOCK = ".moving.lock"
_POLL = 0.2  # s


@contextmanager
def held_while_it_runs(folder: Path, patience: float) -> Iterator[int]:
    """A descriptor for a program to inherit; waits for one of before that still runs.

    Raises
    ------
    NotMeasuredError
        A program of before still runs after `patience` [s].
    """
    path = folder / _LOCK
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {refusal(error)}") from error
    try:
        _take(handle, patience)
        yield handle
    finally:
        os.close(handle)


def _take(handle: int, patience: float) -> None:
    end = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() > end:
                raise NotMeasuredError(
                    "a program that an earlier campaign in this folder started is still running, "
                    "and may be moving the robot. End it, then go on with --resume."
                ) from None
            time.sleep(_POLL)
        except OSError:  # a file system without locks
            return
