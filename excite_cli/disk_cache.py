"""Named arrays on disk, so that what takes seconds is computed once for a robot.

One .npz file per key in the user's cache folder, with a digest of the key and of all it holds: a
file that is missing, damaged, edited or another key's is the same as none. A folder that cannot
be written is no error.
"""

import hashlib
import os
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.atomic import write_atomically
from excite_cli.errors import FileError

Arrays = Mapping[str, NDArray[Any]]

_DIGEST = "digest"


def stored_arrays(key: str) -> dict[str, NDArray[Any]] | None:
    """Arrays stored under `key`, or None."""
    try:
        # Given a name, numpy leaves the file open if it is no whole zip.
        with _path(key).open("rb") as file, np.load(file, allow_pickle=False) as content:
            arrays = {name: content[name] for name in content.files}
    except (OSError, EOFError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error):
        return None
    digest = arrays.pop(_DIGEST, None)
    return arrays if digest is not None and _digest(key, arrays) == digest.tobytes() else None


def store_arrays(key: str, arrays: Arrays) -> None:
    """Write arrays under `key`, whole or not at all."""
    digest = np.frombuffer(_digest(key, arrays), dtype=np.uint8)
    try:
        write_atomically(_path(key), lambda file: _write(file, {**arrays, _DIGEST: digest}))
    except (FileError, RuntimeError):
        return


def _digest(key: str, arrays: Arrays) -> bytes:
    digest = hashlib.sha256(key.encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"|{name}|{array.dtype.str}|{array.shape}|".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.digest()


def _write(path: Path, arrays: Arrays) -> None:
    with path.open("wb") as file:  # a name would be given the suffix .npz
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _path(key: str) -> Path:
    return cache_folder() / f"meshes-{key[:32]}.npz"


def cache_folder() -> Path:
    """`$XDG_CACHE_HOME/excite` or `~/.cache/excite`."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    root = Path(given) if Path(given).is_absolute() else Path("~/.cache").expanduser()
    return root / "excite"
