"""Readers of motion files, and the one way from such a file to a `TimedMotion`."""

from pathlib import Path

from excite_cli.errors import FileError
from excite_cli.given_files import require_stored
from excite_cli.measurement.joint_trajectory import MotionMoveit, MotionRos2
from excite_cli.measurement.motion_bag import MotionBag
from excite_cli.measurement.motion_csv import MotionCsv
from excite_cli.measurement.motion_npz import MotionNpz
from excite_cli.measurement.motion_reader import MotionReader
from excite_cli.measurement.timed_motion import TimedMotion, arranged, checked

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
