"""One output, one run: a claim on a file or folder that dies with its process.

A claim is an advisory lock (flock) on the hidden file `.NAME.lock` beside the output. The lock is
the kernel's, so that none is left by a run that was killed; the file may be left, and the next run
on that output takes it over and removes it. Where a file system has no locks, nothing is claimed.
"""

import atexit
import errno
import fcntl
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock

from excite_cli.errors import FileError, refusal

_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EINVAL, errno.EBADF)
_TRIES = 100  # to open the lock file that is there, while others remove theirs
_PATIENCE, _POLL = 5.0, 0.02  # s, for those who only put a finished file in place


@dataclass(frozen=True)
class _Held:
    """An open lock file, how often it was requested, and the folders made for it, deepest first."""

    handle: int
    count: int
    folders: tuple[Path, ...]


_held: dict[Path, _Held] = {}
_guard = Lock()


def claim(path: Path) -> None:
    """Claim `path` until this process ends, or `leave_claims`.

    What killed runs left beside it is removed.

    Raises
    ------
    FileError
        Another run has it, or its folder cannot be written to.
    """
    target = resolved(path)
    if not _take(target, path):
        raise FileError(
            f"{path} is being written by another run{_owner(target)}. Wait until it ends, or give "
            "another name."
        )


def leave(path: Path) -> None:
    """Give up one claim of `path`."""
    _leave(resolved(path))


@contextmanager
def claimed(path: Path) -> Iterator[None]:
    """As `claim`, but for a moment: waits up to 5 s for another that has it.

    Raises
    ------
    FileError
        As `claim`.
    """
    end, target = time.monotonic() + _PATIENCE, resolved(path)
    while not _take(target, path):
        if time.monotonic() > end:
            claim(path)
            break
        time.sleep(_POLL)
    try:
        yield
    finally:
        _leave(target)


def resolved(path: Path) -> Path:
    """Where `path` leads: a symbolic link stays, and the file that it names is written."""
    return Path(os.path.realpath(path))


def part_prefix(target: Path) -> str:
    """How the name of a temporary file or folder for `target` begins; `.part` is its end."""
    return f".{target.name}."


def _take(target: Path, path: Path) -> bool:
    """Lock `target`, or count once more that this process has it; False if another one does."""
    with _guard:
        if target in _held:
            _held[target] = replace(_held[target], count=_held[target].count + 1)
            return True
        try:
            folders = _made(target.parent)
            found = _locked(_lock_file(target))
        except OSError as error:
            raise FileError(f"{path} cannot be written: {refusal(error)}") from error
        if found is None:
            return False
        handle, alone = found
        _held[target] = _Held(handle, 1, folders)
        with suppress(OSError):  # only for the message of another run
            os.ftruncate(handle, 0)
            os.write(handle, f"{os.getpid()} {os.uname().nodename}".encode())
        if alone:  # without a lock another run may be writing it
            _sweep(target)
        return True


def _leave(target: Path) -> None:
    """Undo one `_take`; the last one removes the lock file, and folders that stayed empty.

    Ctrl-C may come anywhere in it: what is held stays known until its file is gone.
    """
    with _guard:
        held = _held.get(target)
        if held is None:  # in a child that was forked meanwhile
            return
        if held.count > 1:
            _held[target] = replace(held, count=held.count - 1)
            return
        with suppress(OSError):
            _lock_file(target).unlink(missing_ok=True)
        del _held[target]
        os.close(held.handle)
        with suppress(OSError):
            for folder in held.folders:
                folder.rmdir()


def _locked(path: Path) -> tuple[int, bool] | None:
    """The open file `path` and whether it is locked; None if another process has locked it.

    A file that its owner removed between our opening and locking it is not the one that the next
    run will open, so that it is opened again. Where locks are not known, or what is opened never is
    what is found under its name, it is not locked.
    """
    for left in reversed(range(_TRIES)):
        handle = _opened(path)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            return None
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return handle, False
            os.close(handle)
            raise
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), os.stat(path)):
                return handle, True
        if left:
            os.close(handle)
    return handle, False


def _opened(path: Path) -> int:
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except PermissionError:  # left by another user, perhaps: locking needs no more than this
        if not path.exists():
            raise
        return os.open(path, os.O_RDONLY | os.O_CLOEXEC)


def _made(folder: Path) -> tuple[Path, ...]:
    """Make `folder`; return what was made, deepest first."""
    missing = tuple(each for each in (folder, *folder.parents) if not each.exists())
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _sweep(target: Path) -> None:
    """Remove what killed runs left: the claim is ours, so nobody is writing it."""
    import shutil

    left = re.compile(re.escape(part_prefix(target)) + r"[a-z0-9_]{8}\.part")
    with suppress(OSError):
        for entry in os.scandir(target.parent):
            if left.fullmatch(entry.name):
                if entry.is_dir(follow_symlinks=False):
                    shutil.rmtree(entry.path, ignore_errors=True)
                else:
                    Path(entry.path).unlink(missing_ok=True)


def _lock_file(target: Path) -> Path:
    return target.with_name(f".{target.name}.lock")


def _owner(target: Path) -> str:
    """` (process 4711 on host)`, as far as the lock file tells."""
    with suppress(OSError, ValueError):
        process, host = _lock_file(target).read_text(encoding="utf-8").split()
        return f" (process {process} on {host})"
    return ""


def leave_claims() -> None:
    """Give up all claims of this process, as its end does."""
    for target, held in list(_held.items()):
        for _ in range(held.count):
            _leave(target)


def _forget() -> None:
    """In a forked child: claims are the parent's, and must not outlive it."""
    global _guard
    _guard = Lock()
    for held in _held.values():
        with suppress(OSError):
            os.close(held.handle)
    _held.clear()


atexit.register(leave_claims)
os.register_at_fork(after_in_child=_forget)
