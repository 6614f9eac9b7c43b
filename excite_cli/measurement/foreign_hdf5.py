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

# Attributes of HDF5 files from anywhere, looked at before they are read.
#
# A few damaged bytes turn an array of texts into one of lists, and HDF5 follows the addresses that
# it finds there: the process dies. So only numbers, texts and truth values are read.

_PLAIN = (h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.STRING, h5py.h5t.ENUM)


def attribute(item: Any, name: str, default: Any = None) -> Any:
    """The attribute `name` of a file, group or dataset; `default` where there is none.

    Raises
    ------
    ValueError
        It holds neither numbers nor texts.
    """
    if name not in item.attrs:
        return default
    require_plain(item, name)
    return item.attrs[name]


def require_plain(item: Any, *names: str) -> None:
    """See that these attributes, or all of them, hold numbers or texts; ValueError if not."""
    for name in names or item.attrs:
        if h5py.h5a.open(item.id, name.encode()).get_type().get_class() not in _PLAIN:
            raise ValueError(f"the attribute {name!r:.80} holds neither numbers nor texts")


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
