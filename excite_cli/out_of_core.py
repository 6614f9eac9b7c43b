"""Large arrays wait on disk: memory does not grow with the length and the number of logs.

What a `Spool` keeps beyond its first `ROOM` bytes lies in a temporary file without a name, mapped
into memory: it is read like any other array, and the system fetches what is touched. `forget` gives
back what was touched; whoever goes through the data run by run calls it after each.

The file is in $TMPDIR, else in /var/tmp, for /tmp is memory on many machines; it is gone with the
last array in it, or with the process.
"""

import mmap
import os
import tempfile
import weakref
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from excite_cli.errors import FileError

ROOM = 32 * 2**20  # bytes of each spool that stay in memory
_CHUNK = 64 * 2**20
_ALIGNED = 64
_GRANULE = mmap.ALLOCATIONGRANULARITY

_Kind = TypeVar("_Kind", bound=np.generic)
_mapped: "weakref.WeakSet[mmap.mmap]" = weakref.WeakSet()


class Spool:
    """Keeps arrays: the first ones where they are, those beyond `room` bytes on disk."""

    def __init__(self, room: int | None = None) -> None:
        self._left = ROOM if room is None else room
        self._file: int | None = None
        self._size = 0
        self._chunk: mmap.mmap | None = None
        self._at = 0

    def __del__(self) -> None:
        if self._file is not None:
            os.close(self._file)

    def keep(self, values: NDArray[_Kind]) -> NDArray[_Kind]:
        """The same array, to be read only; a repeated one, such as zeros, stays as it is."""
        if not values.nbytes or 0 in values.strides:
            return values
        if self._left >= values.nbytes or not hasattr(os, "pwrite"):
            self._left -= values.nbytes
            return values
        self._left = 0
        return self._on_disk(np.ascontiguousarray(values))

    def keep_rows(self, values: csr_matrix) -> csr_matrix:
        """The same sparse matrix."""
        parts = tuple(self.keep(part) for part in (values.data, values.indices, values.indptr))
        kept = csr_matrix(values.shape)
        kept.data, kept.indices, kept.indptr = parts
        return kept

    def _on_disk(self, values: NDArray[_Kind]) -> NDArray[_Kind]:
        folder = os.environ.get("TMPDIR") or ("/var/tmp" if Path("/var/tmp").is_dir() else None)
        try:
            chunk, at = self._room_for(values.nbytes, folder)
            self._write(values, at)
        except OSError as error:
            raise FileError(
                f"no room for {self._size / 2**30:.2g} GiB of temporary files in "
                f"{folder or tempfile.gettempdir()}: {error.strerror or error}. Make room, or name "
                "another folder in TMPDIR."
            ) from error
        at -= self._size - len(chunk)
        return np.frombuffer(chunk, values.dtype, values.size, at).reshape(values.shape)

    def _room_for(self, size: int, folder: str | None) -> tuple[mmap.mmap, int]:
        """A mapped part of the file, its last one, and where in the file there is room in it."""
        if self._file is None:
            self._file = _nameless(folder)
        if self._chunk is None or self._at + size > self._size:
            more = -(-max(size, _CHUNK) // _GRANULE) * _GRANULE
            self._at, self._size = self._size, self._size + more
            os.ftruncate(self._file, self._size)
            self._chunk = mmap.mmap(self._file, more, access=mmap.ACCESS_READ, offset=self._at)
            _mapped.add(self._chunk)
        at = self._at
        self._at += -(-size // _ALIGNED) * _ALIGNED
        return self._chunk, at

    def _write(self, values: NDArray, at: int) -> None:
        assert self._file is not None
        left = values.data.cast("B")
        while len(left):
            count = os.pwrite(self._file, left, at)
            left, at = left[count:], at + count


def forget() -> None:
    """Give back the memory of all that lies on disk; reading it again fetches it."""
    for each in list(_mapped):
        if hasattr(each, "madvise"):
            each.madvise(mmap.MADV_DONTNEED)


def _nameless(folder: str | None) -> int:
    """A file that goes when it is closed."""
    file, path = tempfile.mkstemp(prefix="excite-", dir=folder)
    os.unlink(path)
    return file
