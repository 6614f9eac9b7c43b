"""Whether somebody is still writing a file."""

import fcntl
import os
import signal
from contextlib import suppress
from pathlib import Path


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
