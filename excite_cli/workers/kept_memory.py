"""Memory that a worker frees stays with it: its next arrays need no cleared pages."""

import ctypes
from functools import cache

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # options of glibc's mallopt
_KEPT, _LARGEST = 128 * 2**20, 32 * 2**20  # bytes; the second is the greatest that glibc takes


@cache
def keep_memory() -> None:
    """Let this process keep what it frees, up to 128 MB, once.

    glibc returns large arrays to the system one by one. A worker of `diagnose` spent a twentieth
    of its time on the pages of those that came next; dask's workers, which are started with
    MALLOC_TRIM_THRESHOLD_=65536, take half as long again for the small arrays of a start.
    """
    try:
        set_option = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library than glibc
        return
    set_option(_TRIM_THRESHOLD, _KEPT)
    set_option(_MMAP_THRESHOLD, _LARGEST)
