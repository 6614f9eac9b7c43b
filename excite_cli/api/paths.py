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


def paths_in(*given: object) -> list[Path]:
    """Those of `given` that are files, also in lists: what a function reads by its path."""
    listed = [x for each in given for x in (each if isinstance(each, list | tuple) else [each])]
    return [Path(each) for each in listed if isinstance(each, str | Path)]
