"""Readers of motion files, and the one way from such a file to a `TimedMotion`."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import ExciteError, FileError
from excite_cli.given_files import require_stored
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.joint_trajectory import MotionMoveit, MotionRos2
from excite_cli.measurement.motion_bag import MotionBag
from excite_cli.measurement.motion_csv import MotionCsv
from excite_cli.measurement.motion_reader import MotionReader
from excite_cli.measurement.reader import MAX_VALUES, check_unpacked
from excite_cli.measurement.timed_motion import TimedMotion, arranged, checked

# Motions as NumPy archives: t (T,), q, v, a (T, n) and joint_names (n,), without pickles.


class MotionNpz(MotionReader):
    """`.npz`, packed or not."""

    title = "NumPy"
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


MOTION_READERS: tuple[MotionReader, ...] = (
    MotionCsv(),
    MotionNpz(),
    MotionRos2(),
    MotionMoveit(),
    MotionBag(),
)


def motion_reader_for(path: Path, measured: tuple[str, ...] = ("tau",)) -> MotionReader | None:
    """The reader of a motion file; None for what is none, as data with columns `measured` ….

    Raises
    ------
    FileError
        There is no such file.
    """
    require_stored(path)
    return next((reader for reader in MOTION_READERS if reader.recognises(path, measured)), None)


def read_motion(path: Path, joints: tuple[str, ...]) -> tuple[TimedMotion, str]:
    """The motion of a file with columns in the order of `joints`, and a note (or nothing).

    Raises
    ------
    FileError
        The file is missing, damaged, of no known format, or moves other joints.
    MissingExtraError
        A bag, and the library for bags is not installed.
    """
    return arranged(path, read_own_motion(path), joints)


def read_own_motion(path: Path) -> TimedMotion:
    """The motion of a file with the columns that it has; errors as `read_motion`."""
    reader = motion_reader_for(path)
    if reader is None:
        known = "; ".join(f"{each.title}: {', '.join(each.suffixes)}" for each in MOTION_READERS)
        raise FileError(f"{path} is of no format that holds motions. Read are {known}.")
    return checked(path, reader.read(path))
