"""Paths that are given, seen to before any work begins."""

from pathlib import Path

from excite_cli.errors import FileError


def existing(path: str | Path) -> Path:
    """The path of a file or folder that is there.

    Raises
    ------
    FileError
        It is not.
    """
    if not Path(path).exists():
        raise FileError(f"There is no file {path}.")
    return Path(path)
