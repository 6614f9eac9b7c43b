"""HDF5 files from anywhere: opened within a limit of memory, and read only where their data lie.

Whatever the library fails with, the message is one sentence that names the file.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from excite_cli.errors import ExciteError, FileError
from excite_cli.measurement.memory_limit import is_shortage, limited_memory, short_of_memory
from excite_cli.measurement.reader import check_size


@contextmanager
def opened(path: Path, kind: str = "HDF5 file") -> Iterator[Any]:
    """The open file; `kind` is what a message calls it.

    Raises
    ------
    FileError
        It is no such file, damaged, or too large, also while it is read.
    """
    check_size(path)
    try:
        with limited_memory(path), h5py.File(path, "r") as file:
            yield file
    except ExciteError:
        raise
    except OSError as error:
        if is_shortage(error):
            raise short_of_memory(path) from error
        raise FileError(
            f"{path} is not a readable {kind} ({error}). If it was being written when the "
            "program ended, it is lost."
        ) from error
    # Damaged bytes lead the library to whatever error: also of indices, sizes and encodings.
    except Exception as error:
        if is_shortage(error):
            raise short_of_memory(path) from error
        raise FileError(f"{path} is damaged, or not measured data: {error}.") from error


def member(path: Path, group: Any, name: str) -> Any:
    """An object of the file itself; links may lead anywhere, also out of the file."""
    link = group.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink):
        raise FileError(
            f"{path}: '{group.name.rstrip('/')}/{name}' is a link; only data in the file itself "
            "is read. Copy the data in place of the link."
        )
    return kept_inside(path, group[name])


def kept_inside(path: Path, item: Any) -> Any:
    """The same object, if its data lie in the file; FileError if not."""
    if isinstance(item, h5py.Dataset) and (item.is_virtual or item.external):
        raise FileError(
            f"{path}: '{item.name}' keeps its data in other files; only data in the file itself "
            "is read."
        )
    return item
