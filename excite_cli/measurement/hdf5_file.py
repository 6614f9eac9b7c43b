"""New HDF5 files, made in memory and then written in one go.

The HDF5 library does not survive a full disk: it fails once more when it closes the file, and again
when the program ends. Bytes written by Python fail once, with the reason.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py


@contextmanager
def new_hdf5(path: Path) -> Iterator[Any]:
    """An open HDF5 file to be filled; at the end its bytes are written to `path`.

    Raises
    ------
    OSError
        They cannot be written.
    """
    content = BytesIO()
    with h5py.File(content, "w") as file:
        yield file
    with path.open("wb") as written:
        written.write(content.getbuffer())
