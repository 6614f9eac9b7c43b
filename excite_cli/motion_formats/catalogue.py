"""All motion formats by the name on the command line, and the one way from a file to a motion."""

from pathlib import Path

from excite_cli.errors import FileError
from excite_cli.given_files import require_stored
from excite_cli.motion_formats.base import MotionFormat
from excite_cli.motion_formats.timed_motion import TimedMotion, arranged, checked
from excite_cli.registry import Registry

MOTION_FORMATS: Registry[MotionFormat] = Registry(
    "motion format",
    "excite.motion_formats",
    MotionFormat,
    {
        "csv": "csv_table:CsvTable",
        "ros2": "ros2_yaml:Ros2Yaml",
        "rosbag2": "rosbag2:Rosbag2",
        "mcap": "rosbag2:Mcap",
        "moveit": "moveit_json:MoveitJson",
        "npz": "npz_archive:NpzArchive",
    },
    ("name", "title", "suffixes"),
)


def motion_format_of(path: Path, measured: tuple[str, ...] = ("tau",)) -> MotionFormat | None:
    """The format of a motion file; None for what is none, as data with columns `measured` …."""
    require_stored(path)
    formats = (found() for found in MOTION_FORMATS.foreign_first)
    return next((each for each in formats if each.recognises(path, measured)), None)


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
    found = motion_format_of(path)
    if found is None:
        formats = MOTION_FORMATS.members.values()
        known = "; ".join(f"{each.title}: {', '.join(each.suffixes)}" for each in formats)
        raise FileError(f"{path} is of no format that holds motions. Read are {known}.")
    return checked(path, found.read(path))
