"""The family of motion formats: a timed motion in, a file that a controller takes out."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from excite_cli.atomic import write_atomically
from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.timed_motion import TimedMotion


class MotionExporter(ABC):
    """A file format.

    `whole_nanoseconds`: its instants are integers, so that the motion must be sampled at such.
    `folder`: what it writes is a folder.
    """

    name: ClassVar[str]
    suffix: ClassVar[str]
    whole_nanoseconds: ClassVar[bool] = False
    folder: ClassVar[bool] = False

    def write(self, path: Path, motion: TimedMotion) -> None:
        """Write `motion` whole or not at all.

        Raises
        ------
        FileError
            The file cannot be written.
        MissingExtraError
            The library for this format is not installed.
        """
        write_atomically(path, lambda temporary: self._write(temporary, motion))

    @abstractmethod
    def _write(self, path: Path, motion: TimedMotion) -> None:
        """Fill the file `path`."""


def states_of(motion: TimedMotion) -> tuple[Array, Array, Array]:
    """q, v, a (T, n) of a motion that has them all.

    Raises
    ------
    FileError
        Speeds or accelerations are not known.
    """
    if motion.v is None or motion.a is None:
        raise FileError(f"{motion.name}: only a motion with speeds and accelerations is exported.")
    return motion.q, motion.v, motion.a


# A timed motion as the fields of trajectory_msgs/msg/JointTrajectory.

_NANO = 10**9


def joint_trajectory(motion: TimedMotion) -> dict[str, Any]:
    """The message as dictionaries and lists, every field of its definition in order."""
    stamps = np.rint(motion.t * _NANO).astype(np.int64).tolist()
    rows = zip(stamps, *(x.tolist() for x in states_of(motion)), strict=True)
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(motion.joint_names),
        "points": [
            {
                "positions": q,
                "velocities": v,
                "accelerations": a,
                "effort": [],
                "time_from_start": {"sec": stamp // _NANO, "nanosec": stamp % _NANO},
            }
            for stamp, q, v, a in rows
        ],
    }
