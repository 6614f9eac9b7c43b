"""Files and folders appear whole or not at all, whatever ends the program or the machine.

What is written goes to a temporary name beside the target, `.NAME.xxxxxxxx.part`, is forced to the
disk, and takes the target's place in one step. A process that is killed may leave the temporary
one; the next run on that output removes it (`claim`).
"""

import ctypes
import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from excite_cli.claim import claimed, part_prefix, resolved
from excite_cli.errors import FileError, refusal

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2  # of Linux


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then put it in place.

    Raises
    ------
    FileError
        The folder cannot be written to, `path` is not a regular file, the disk is full, or another
        run is writing it.
    """
    with _refusals(path), claimed(path):
        target = resolved(path)
        if target.exists() and not target.is_file():
            what = "a folder" if target.is_dir() else "not a regular file"
            raise FileError(f"{path} is {what}. Give a file name.")
        handle, name = tempfile.mkstemp(".part", part_prefix(target), target.parent)
        os.close(handle)
        temporary = Path(name)
        try:
            write(temporary)
            wanted = 0o666 & ~_umask()
            if stat.S_IMODE(temporary.stat().st_mode) != wanted:  # a confined process may not
                temporary.chmod(wanted)
            _to_disk(temporary)
            os.replace(temporary, target)
            _to_disk(target.parent)
        finally:
            temporary.unlink(missing_ok=True)


def write_text_atomically(path: Path, text: str) -> None:
    """Put `text` in place as UTF-8; raises as `write_atomically` does."""
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_folder_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` make the folder it is given, then put that in the place of `path`.

    Raises
    ------
    FileError
        As `write_atomically`.
    """
    with _refusals(path), claimed(path):
        target = resolved(path)
        temporary = Path(tempfile.mkdtemp(".part", part_prefix(target), target.parent))
        try:
            made = temporary / target.name
            write(made)
            for each in (*made.rglob("*"), made):
                _to_disk(each)
            if target.exists():
                _exchange(made, target, temporary / "old")
            else:
                os.replace(made, target)
            _to_disk(target.parent)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def _refusals(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise FileError(f"{path} cannot be written: {refusal(error)}") from error


def _exchange(made: Path, target: Path, old: Path) -> None:
    """Put `made` in the place of the folder `target`: in one step where the system can do that."""
    with suppress(AttributeError, OSError):
        names = (os.fsencode(made), os.fsencode(target))
        rename = ctypes.CDLL(None, use_errno=True).renameat2
        if rename(_AT_FDCWD, names[0], _AT_FDCWD, names[1], ctypes.c_uint(_RENAME_EXCHANGE)) == 0:
            return
    os.replace(target, old)
    os.replace(made, target)


def _to_disk(path: Path) -> None:
    """Wait until `path` is on the disk, so that a power cut leaves the old or the new."""
    handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EROFS):  # cannot: no promise
            raise
    finally:
        os.close(handle)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
