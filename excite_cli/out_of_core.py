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
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from excite_cli.errors import FileError

ROOM = 32 * 2**20  # bytes of each spool that stay in memory
_SMALL = 4096  # bytes of an array that stays there, whatever the room
_CHUNK = 64 * 2**20
_ALIGNED = 64
_GRANULE = mmap.ALLOCATIONGRANULARITY

_Kind = TypeVar("_Kind", bound=np.generic)


class _File:
    """A file without a name; it goes when the last who needs it does, in whatever process."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        status = os.fstat(descriptor)
        self.key = status.st_dev, status.st_ino
        _files[self.key] = self

    @classmethod
    def new(cls, folder: str | None) -> "_File":
        descriptor, path = tempfile.mkstemp(prefix="excite-", dir=folder)
        os.unlink(path)
        return cls(descriptor)

    def __del__(self) -> None:
        os.close(self.descriptor)


@dataclass(frozen=True)
class ArrayLocation:
    """Where an array lies: `at` bytes into a mapped `part` (offset, size) of a file.

    That is the file `descriptor` of the process `process`, with `file` as device and inode, for
    descriptors are used again.
    """

    process: int
    descriptor: int
    file: tuple[int, int]
    part: tuple[int, int]
    at: int
    kind: str
    shape: tuple[int, ...]
    strides: tuple[int, ...]


# Files and their mapped parts that somebody needs, of this process and of others.
_mapped: "weakref.WeakKeyDictionary[mmap.mmap, tuple[_File, int]]" = weakref.WeakKeyDictionary()
_files: "weakref.WeakValueDictionary[tuple[int, int], _File]" = weakref.WeakValueDictionary()
_parts: "weakref.WeakValueDictionary[tuple[int, ...], mmap.mmap]" = weakref.WeakValueDictionary()


_room: ContextVar[int | None] = ContextVar("room of spools", default=None)


@contextmanager
def room_of_spools(room: int | None) -> Iterator[None]:
    """Within the block, bytes of each spool that stay in memory (None: `ROOM`)."""
    before = _room.set(room)
    try:
        yield
    finally:
        _room.reset(before)


class Spool:
    """Keeps arrays: the first ones where they are, those beyond `room` bytes on disk."""

    def __init__(self, room: int | None = None) -> None:
        room = _room.get() if room is None else room
        self._left = ROOM if room is None else room
        self._file: _File | None = None
        self._size = 0
        self._chunk: mmap.mmap | None = None
        self._at = 0

    def keep(self, values: NDArray[_Kind]) -> NDArray[_Kind]:
        """The same array, to be read only; a repeated one, such as zeros, stays as it is."""
        if not values.nbytes or 0 in values.strides:
            return values
        if _part_of(values) is not None:
            return values  # on disk already
        small = values.nbytes < _SMALL
        if small or self._left >= values.nbytes or not hasattr(os, "pwrite"):
            self._left -= 0 if small else values.nbytes
            return values
        self._left = 0
        return self._on_disk(np.ascontiguousarray(values))

    @property
    def size(self) -> int:
        """Bytes of its file."""
        return self._size

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
            self._file = _File.new(folder)
        if self._chunk is None or self._at + size > self._size:
            more = -(-max(size, _CHUNK) // _GRANULE) * _GRANULE
            self._at, self._size = self._size, self._size + more
            os.ftruncate(self._file.descriptor, self._size)
            self._chunk = _mapped_part(self._file, self._at, more)
        at = self._at
        self._at += -(-size // _ALIGNED) * _ALIGNED
        return self._chunk, at

    def _write(self, values: NDArray, at: int) -> None:
        assert self._file is not None
        left = values.data.cast("B")
        while len(left):
            count = os.pwrite(self._file.descriptor, left, at)
            left, at = left[count:], at + count


def forget() -> None:
    """Give back the memory of all that lies on disk; reading it again fetches it."""
    for reference in _mapped.keyrefs():  # a list at once: other threads may map more meanwhile
        each = reference()
        if each is not None and hasattr(each, "madvise"):
            each.madvise(mmap.MADV_DONTNEED)


def reference_to(values: NDArray) -> ArrayLocation | None:
    """Where in a file of this process an array lies, also a part of one; None if it does not."""
    part = _part_of(values)
    if part is None or not values.size or min(values.strides, default=0) < 0:
        return None
    file, offset = _mapped[part]
    start = np.frombuffer(part, np.uint8, 1).ctypes.data
    return ArrayLocation(
        os.getpid(),
        file.descriptor,
        file.key,
        (offset, len(part)),
        values.ctypes.data - start,
        values.dtype.str,
        values.shape,
        values.strides,
    )


def attached(reference: ArrayLocation) -> NDArray:
    """The array in another process's file, to be read only, whatever becomes of that process.

    Raises
    ------
    OSError
        That process or its file is gone.
    """
    key = *reference.file, *reference.part
    part = _parts.get(key)
    if part is None:
        file = _files.get(reference.file)
        if file is None:
            path = f"/proc/{reference.process}/fd/{reference.descriptor}"
            file = _File(os.open(path, os.O_RDONLY))
            if file.key != reference.file:
                raise FileNotFoundError(f"{path}: the file is gone")
        part = _mapped_part(file, *reference.part)
    whole = np.frombuffer(part, np.uint8)
    kind = np.dtype(reference.kind)
    return np.ndarray(reference.shape, kind, whole, reference.at, reference.strides)


def _mapped_part(file: _File, at: int, size: int) -> mmap.mmap:
    part = mmap.mmap(file.descriptor, size, access=mmap.ACCESS_READ, offset=at)
    _mapped[part] = file, at
    _parts[*file.key, at, size] = part
    return part


def _part_of(values: NDArray) -> mmap.mmap | None:
    """The mapped part of a file that an array lies in."""
    base: object = values
    while isinstance(base, np.ndarray):
        base = base.base
    owner = base.obj if isinstance(base, memoryview) else base
    return owner if isinstance(owner, mmap.mmap) and owner in _mapped else None
