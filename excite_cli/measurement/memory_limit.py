"""A limit of memory while a file that may be anyone's is read.

A few damaged bytes make HDF5 ask for gigabytes: for a text whose length they state, or for a heap.
While the limit holds such a request fails inside the library, which says so, and nothing is lost.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_LEAST = 2**30  # bytes that any file may take
_PER_BYTE = 24  # of memory for each of the file: as doubles, with copies in between


@contextmanager
def limited_memory(path: Path) -> Iterator[None]:
    """Let this process grow by a gibibyte, or by what a file of this size needs, and no more.

    It does nothing where the system has no such limit.
    """
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        now = pages * resource.getpagesize()
    except (ImportError, OSError, ValueError, IndexError):
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = now + max(_LEAST, _PER_BYTE * path.stat().st_size)
    if soft != resource.RLIM_INFINITY and soft <= most:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
