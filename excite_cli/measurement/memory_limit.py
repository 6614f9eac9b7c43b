"""A limit of memory while an untrusted file is read.

A few damaged bytes make HDF5 ask for gigabytes: for a text whose length they state, or for a heap.
While the limit holds such a request fails inside the library, which says so, and nothing is lost.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from excite_cli.errors import FileError

_LEAST = 2**30  # bytes that any file may take
_PER_BYTE = 24  # of memory for each of the file: as doubles, with copies in between
_COPIES = 4  # of what it unpacks to: the packed part grows by doubling, then the doubles


def address_space() -> int | None:
    """Bytes of addresses that this process has reserved; None where the system does not say."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        return pages * resource.getpagesize()
    except (ImportError, OSError, ValueError, IndexError):
        return None


@contextmanager
def limited_memory(path: Path, unpacked: int = 0) -> Iterator[None]:
    """Let this process grow by a gibibyte, or by what a file of this size needs, and no more.

    `unpacked`: bytes that the file holds once read, where they are known and allowed; inside
    another limit they raise it. The limit is that of the process: where several threads read, the
    most that any of them may take holds for all, until the last has read. It does nothing where the
    system has no such limit.
    """
    now = address_space()
    if now is None:
        yield
        return
    _limit.enter(now + max(_LEAST, _PER_BYTE * path.stat().st_size, _COPIES * unpacked))
    try:
        yield
    finally:
        _limit.leave()


def is_shortage(error: BaseException) -> bool:
    """Whether memory was refused: by Python, or inside a library that says so in words only."""
    return isinstance(error, MemoryError) or "allocat" in str(error).lower()


def short_of_memory(path: Path) -> FileError:
    """What is said of a file for which memory was refused."""
    return FileError(
        f"{path} has {path.stat().st_size / 2**20:.3g} MiB, and there is not enough memory to read "
        "it. Free memory, cut it into several runs, or lower its rate. If it is small for that, it "
        "is damaged."
    )


class _Limit:
    """The limit of this process: lowered by the first that enters, restored by the last."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = self._most = 0
        self._before = (0, 0)

    def enter(self, most: int) -> None:
        """Let the process take `most` bytes of addresses in all, unless it may take fewer."""
        import resource

        with self._lock:
            if not self._inside:
                self._before, self._most = resource.getrlimit(resource.RLIMIT_AS), 0
            soft, hard = self._before
            self._most = max(most, self._most)
            lower = self._most if soft == resource.RLIM_INFINITY else min(soft, self._most)
            resource.setrlimit(resource.RLIMIT_AS, (lower, hard))
            self._inside += 1

    def leave(self) -> None:
        """Restore what there was, once nobody is inside."""
        import resource

        with self._lock:
            self._inside -= 1
            if not self._inside:
                resource.setrlimit(resource.RLIMIT_AS, self._before)


_limit = _Limit()
