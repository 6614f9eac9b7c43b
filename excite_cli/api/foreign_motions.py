"""Motions that were not planned here: formats of controllers, and measured positions."""

from pathlib import Path

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.errors import FileError
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.base_channel import channels_of_base
from excite_cli.measurement.dataset import Dataset
from excite_cli.motion_formats.catalogue import motion_format_of, read_motion
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.trajectory.fade import Segment
from excite_cli.trajectory.sampled import through_samples

# Share of the position limits from which positions are taken for another unit.
_FAR_BEYOND = 4.0


def is_motion(path: Path, spec: Spec | None = None) -> bool:
    """Whether the file holds a motion in a controller's format, not measured data.

    Raises
    ------
    FileError
        There is no such file.
    """
    measured = ["tau"]
    if spec is not None:
        measured = [spec.measurement.channels.get("tau") or "tau"]
        if "base" in spec.robot.rows:
            measured += [channel.name for channel in channels_of_base(spec.measurement)]
    return motion_format_of(path, tuple(measured)) is not None


def read_segment(path: Path, robot: Robot, tell: Tell) -> Segment:
    """The motion of a controller's file, speeds and accelerations filled in where it has none."""
    motion, note = read_motion(path, robot.joint_names)
    _refuse_degrees(path, motion.q, robot)
    if note:
        tell(Note(Level.INFO, f"{path}: {note}"))
    missing = "speeds and accelerations" if motion.v is None else "accelerations"
    if motion.v is None or motion.a is None:
        text = f"its {missing} are those of a spline of degree 5 through the samples"
        tell(Note(Level.INFO, f"{path}: {text}"))
    return Segment(motion.name, *through_samples(motion.t, motion.q, motion.v, motion.a))


def _refuse_degrees(path: Path, q: Array, robot: Robot) -> None:
    """Positions (T, n) far beyond what the robot can reach are in another unit."""
    limits = robot.limits
    reach = np.maximum(np.abs(limits.lower), np.abs(limits.upper))
    share = np.abs(q).max(axis=0) / np.where(np.isfinite(reach) & (reach > 0), reach, np.inf)
    worst = int(np.argmax(share))
    if share[worst] > _FAR_BEYOND:
        raise FileError(
            f"{path}: '{robot.joint_names[worst]}' reaches {np.abs(q[:, worst]).max():.3g}, its "
            f"limits are {limits.lower[worst]:.3g} and {limits.upper[worst]:.3g}. Are these "
            "degrees, or millimetres? Positions are in rad (m for prismatic joints)."
        )


def measured_motions(spec: Spec, data: Dataset) -> list[Segment]:
    """Measured positions as motions, filtered as for identification."""
    processing = choose_processing(data.runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    runs = prepare_all(data.runs, processing)
    own = slice(data.runs[0].base_rows, None)  # what is planned are motions of the joints
    return [
        Segment(run.run.key, *through_samples(run.t, run.q[:, own], run.v[:, own], run.a[:, own]))
        for run in runs
    ]
