"""Paths that are given, seen to before any work begins."""

from collections.abc import Iterable
from pathlib import Path

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Dataset


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


def page_path(path: str | Path, hint: str = "") -> Path:
    """The path of a page that may be written.

    Raises
    ------
    FileError
        Its name is not that of a page.
    """
    if Path(path).suffix.lower() not in (".html", ".htm") and not Path(path).is_dir():
        raise FileError(f"-o {path}: a report is a page, NAME.html.{hint}")
    return Path(path)


def paths_in(*given: object) -> list[Path]:
    """Those of `given` that are files, also in lists, and the files that data were read from."""
    listed = [x for each in given for x in (each if isinstance(each, list | tuple) else [each])]
    read = [x for each in listed for x in (each.sources if isinstance(each, Dataset) else [each])]
    return [Path(each) for each in read if isinstance(each, str | Path)]


def refuse_twice(paths: Iterable[Path]) -> None:
    """See that no file is given twice, whatever it is called.

    Raises
    ------
    FileError
        One is.
    """
    seen: set[Path] = set()
    for path in paths:
        if path.resolve() in seen:
            raise FileError(f"{path} is given twice.")
        seen.add(path.resolve())
