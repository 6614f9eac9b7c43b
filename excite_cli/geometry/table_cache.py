"""Named arrays on disk, so that what takes seconds is computed once for a robot.

One .npz file per key in the folder of the capsules. A file that is missing or damaged is the same
as none; a folder that cannot be written is no error.
"""

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from excite_cli.atomic import write_atomically
from excite_cli.errors import FileError
from excite_cli.geometry.capsule_cache import cache_folder

Array = NDArray[np.float64]


def stored_arrays(key: str) -> dict[str, Array] | None:
    """Arrays stored under `key`, or None."""
    try:
        with np.load(_path(key), allow_pickle=False) as content:
            return {name: content[name] for name in content.files}
    except (OSError, EOFError, RuntimeError, ValueError, zipfile.BadZipFile):
        return None


def store_arrays(key: str, arrays: dict[str, Array]) -> None:
    """Write arrays under `key`, whole or not at all."""
    try:
        write_atomically(_path(key), lambda file: _write(file, arrays))
    except (FileError, RuntimeError):
        return


def _write(path: Path, arrays: dict[str, Array]) -> None:
    with path.open("wb") as file:  # a name would be given the suffix .npz
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _path(key: str) -> Path:
    return cache_folder() / f"meshes-{key[:32]}.npz"
