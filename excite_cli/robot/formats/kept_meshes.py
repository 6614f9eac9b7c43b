"""Meshes that a conversion makes: files of the cache, named by the hash of their bytes."""

import hashlib
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.atomic import write_atomically
from excite_cli.disk_cache import cache_folder
from excite_cli.errors import FileError, RobotError


def keep_mesh(points: NDArray[np.float64], faces: NDArray[Any], folder: Path | None = None) -> Path:
    """The binary STL with triangles `faces` (F, 3) of `points` (N, 3) [m], in the cache.

    Or in another folder.

    Raises
    ------
    RobotError
        It cannot be written.
    """
    content = _stl(points, faces)
    path = (folder or kept_meshes_folder()) / f"{_name(content)}.stl"
    try:
        if not is_sound(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, lambda temporary: temporary.write_bytes(content))
    except (OSError, FileError) as error:
        raise RobotError(
            f"meshes of converted robots are kept in {path.parent}, which cannot be written: "
            f"{error}. Set XDG_CACHE_HOME to a folder that can."
        ) from error
    return path


def kept_meshes_folder() -> Path:
    """Where they lie."""
    return cache_folder() / "meshes"


def is_sound(path: Path) -> bool:
    """Whether the file is there, with the content that it is named by."""
    try:
        return path.stem == _name(path.read_bytes())
    except OSError:
        return False


def _name(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def _stl(points: NDArray[np.float64], faces: NDArray[Any]) -> bytes:
    records = np.zeros(
        len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]
    )
    records["corners"] = points[faces]
    return b"\0" * 80 + struct.pack("<I", len(faces)) + records.tobytes()
