"""That a log is one: what measured it has ended well, which is recorded beside the log.

A file alone says nothing of that: it is there while a program still writes it, and after one that
failed. The record holds a digest of the log, so that it is about no other.
"""

import hashlib
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from excite_cli.atomic import write_text_atomically
from excite_cli.errors import FileError


def digest_of(log: Path) -> str:
    """SHA-256 of a file, or of all files of a folder and their names."""
    whole = hashlib.sha256()
    for path in _files(log):
        with path.open("rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
        if path == log:
            return found
        whole.update(f"{path.relative_to(log)}\n{found}\n".encode(errors="surrogateescape"))
    return whole.hexdigest()


def size_of(log: Path) -> int:
    """Bytes of a file, or of all files of a folder."""
    return sum(path.stat().st_size for path in _files(log))


def same_file(log: Path, others: Iterable[Path]) -> Path | None:
    """One of `others` that holds the same bytes as `log`."""
    with suppress(OSError):
        size = size_of(log)
        alike = [each for each in others if each.exists() and size_of(each) == size]
        found = digest_of(log) if alike else ""
        return next((each for each in alike if digest_of(each) == found), None)
    return None


def record_measured(log: Path) -> None:
    """Record that `log` is whole, once it is on the disk.

    Raises
    ------
    FileError
        It cannot be read, or its folder cannot be written to.
    """
    try:
        for path in _files(log):
            with path.open("rb") as file:
                os.fsync(file.fileno())
        text = json.dumps({"log": log.name, "sha256": digest_of(log)})
    except OSError as error:
        raise FileError(f"{log} cannot be read: {error.strerror}.") from error
    write_text_atomically(record_of(log), text + "\n")


def is_measured(log: Path) -> bool:
    """Whether it is recorded that `log`, as it is now, is whole."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        return bool(json.loads(record_of(log).read_bytes())["sha256"] == digest_of(log))
    return False


def record_of(log: Path) -> Path:
    """Where it is recorded that `log` is whole."""
    return log.with_name(f"{log.stem}.measured.json")


def _files(log: Path) -> list[Path]:
    return sorted(path for path in log.rglob("*") if path.is_file()) if log.is_dir() else [log]
