"""NumPy archive: t (T,), q, v, a (T, n), joint_names (n,); numbers and text, no pickles."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import ExciteError, FileError
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.reader import MAX_VALUES, check_unpacked
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.timed_motion import TimedMotion


class NpzArchive(MotionFormat):
    """`.npz`, packed or not."""

    name, title = "npz", "NumPy"
    suffixes = (".npz",)

    def read(self, path: Path) -> TimedMotion:
        """Arrays by name; those of other names are not opened."""
        try:
            with zipfile.ZipFile(path) as archive:
                there = {n.removesuffix(".npy") for n in archive.namelist()}
                missing = [name for name in ("t", "q", "joint_names") if name not in there]
                if missing:
                    raise FileError(
                        f"{path} has no array '{missing[0]}'; it has: "
                        f"{', '.join(sorted(there)) or 'nothing'}. A motion has t (T,), q (T, n), "
                        "joint_names (n,) and, where they are known, v and a (T, n)."
                    )
                names = np.atleast_1d(_array(path, archive, "joint_names", "U"))
                t = _array(path, archive, "t", "fiu").astype(float)
                states = [
                    _array(path, archive, name, "fiu").astype(float) if name in there else None
                    for name in ("q", "v", "a")
                ]
        except ExciteError:
            raise
        # Damaged headers lead the library to errors of its own parser, of zlib, of anything.
        except Exception as error:
            raise FileError(f"{path} is not a readable .npz file: {error}.") from error
        shape = (len(t) if t.ndim == 1 else -1, names.size)
        for name, array in zip(("q", "v", "a"), states, strict=True):
            if array is not None and array.shape != shape:
                raise FileError(
                    f"{path}: '{name}' has shape {array.shape} and t {t.shape}; expected (T, n) "
                    f"and (T,), with n = {names.size} joint_names."
                )
        q, v, a = states
        assert q is not None
        return TimedMotion(path.stem, tuple(str(name) for name in names.ravel()), t, q, v, a)

    def fill(self, path: Path, motion: TimedMotion) -> None:
        """Packed."""
        q, v, a = motion.states
        names = np.array(motion.joint_names, dtype=np.str_)
        with path.open("wb") as file:
            np.savez_compressed(file, t=motion.t, q=q, v=v, a=a, joint_names=names)


def _array(path: Path, archive: zipfile.ZipFile, name: str, kinds: str) -> Any:
    """One array, once its header is known to claim no more than the archive holds."""
    member = f"{name}.npy"
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        read = (
            np.lib.format.read_array_header_1_0
            if version == (1, 0)
            else np.lib.format.read_array_header_2_0
        )
        shape, _, dtype = read(file)
    count = int(np.prod([float(size) for size in shape]))
    if dtype.kind not in kinds:
        what = "names as text" if kinds == "U" else "numbers"
        raise FileError(f"{path}: '{name}' holds {dtype}, not {what}. Pickles are never opened.")
    if count > MAX_VALUES or count * dtype.itemsize > archive.getinfo(member).file_size:
        raise FileError(f"{path}: '{name}' claims {count:,} values, more than are there or read.")
    check_unpacked(path, count * dtype.itemsize)
    with archive.open(member) as file:
        array: Array = np.lib.format.read_array(file, allow_pickle=False)
    return array
