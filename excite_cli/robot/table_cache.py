"""Named arrays on disk, so that what takes seconds is computed once for a robot.

One .npz file per key in the folder of the capsules. A file that is missing or damaged is the same
as none; a folder that cannot be written is no error.
"""

import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.capsule_cache import cache_folder

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
        path = _path(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(
            "wb", dir=path.parent, prefix=".meshes-", delete=False
        ) as file:
            np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
        os.replace(file.name, path)
    except (OSError, RuntimeError):
        return


def _path(key: str) -> Path:
    return cache_folder() / f"meshes-{key[:32]}.npz"
