"""Motions from files of any kind: results, formats of controllers, measured data."""

from pathlib import Path
from typing import TYPE_CHECKING

from excite_cli.cli.console import Terminal
from excite_cli.errors import FileError

if TYPE_CHECKING:
    from excite_cli.config.spec import Spec
    from excite_cli.excitation.result import Result
    from excite_cli.identification.prepare import PreparedRun
    from excite_cli.robot.model import Array, Robot
    from excite_cli.trajectory.chain import Segment

# Share of the position limits from which positions are taken for another unit.
_FAR_BEYOND = 4.0


def load_motions(
    terminal: Terminal,
    path: Path,
    robot: "Robot",
    spec: "Spec",
    chosen: list[int] | None = None,
) -> "list[Segment]":
    """The motions of a file, joints in the robot's order; `chosen` of a result's by their index.

    A file of measured data gives its runs, filtered as for identification.

    Raises
    ------
    FileError
        The file cannot be read, moves other joints, or lacks a chosen motion.
    """
    from excite_cli.store.result_file import is_result, read_result
    from excite_cli.trajectory.chain import Segment
    from excite_cli.trajectory.sampled import through_samples

    if is_result(path):
        result = read_result(path)
        if result.joint_names != robot.joint_names:
            raise FileError(
                f"{path} moves other joints than the config: {', '.join(result.joint_names)}. Take "
                "the config that the motions were made with."
            )
        return motions_of_result(path, result, chosen)
    from excite_cli.store.diagnosis_file import is_diagnosis  # slow to import
    from excite_cli.store.fit_file import is_fit

    if path.is_file() and (is_fit(path) or is_diagnosis(path)):
        read_result(path)  # tells that these are no motions
    if chosen and chosen != [1]:
        raise FileError(f"--motion {chosen[0]}: {path} is no result file; it holds one motion.")
    if is_motion(path, spec):
        return [_motion(terminal, path, robot)]
    return [
        Segment(run.run.key, *through_samples(run.t, run.q, run.v, run.a))
        for run in _measured(terminal, path, robot, spec)
    ]


def _refuse_degrees(path: Path, q: "Array", robot: "Robot") -> None:
    """Positions (T, n) far beyond what the robot can reach are in another unit."""
    import numpy as np

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


def motions_of_result(
    path: Path, result: "Result", chosen: list[int] | None = None
) -> "list[Segment]":
    """Motions with the trajectory that the file itself says they have.

    Raises
    ------
    FileError
        There are none, one that is chosen is missing, or coefficients do not fit.
    """
    from excite_cli.config.load import parse_spec
    from excite_cli.trajectory.catalogue import build_trajectory
    from excite_cli.trajectory.chain import Segment

    stored = parse_spec(result.config, f"the config stored in {path}")
    trajectory = build_trajectory(stored.trajectory)
    there = {motion.index: motion for motion in result.motions}
    if not there:
        raise FileError(f"{path} holds no motion. Make some with `excite optimize`.")
    for index in chosen or ():
        if index not in there:
            raise FileError(
                f"{path} has no motion {index}; it has {', '.join(map(str, there))} (--motion)."
            )
    shape = (trajectory.n_coefficients, len(result.joint_names))
    if any(motion.coefficients.shape != shape for motion in there.values()):
        raise FileError(f"{path}: coefficients do not have the shape {shape} of its trajectory.")
    return [
        Segment(f"motion_{index}", trajectory, there[index].coefficients)
        for index in dict.fromkeys(chosen or there)
    ]


def is_motion(path: Path, spec: "Spec | None" = None) -> bool:
    """Whether the file holds a motion in a controller's format, not measured data.

    Raises
    ------
    FileError
        There is no such file.
    """
    from excite_cli.measurement.motion_files import motion_reader_for

    torque = spec.measurement.channels.get("tau") if spec is not None else None
    return motion_reader_for(path, torque or "tau") is not None


def _motion(terminal: Terminal, path: Path, robot: "Robot") -> "Segment":
    from excite_cli.measurement.motion_files import read_motion
    from excite_cli.trajectory.chain import Segment
    from excite_cli.trajectory.sampled import through_samples

    motion, note = read_motion(path, robot.joint_names)
    _refuse_degrees(path, motion.q, robot)
    if note:
        terminal.say(f"{path}: {note}")
    missing = "speeds and accelerations" if motion.v is None else "accelerations"
    if motion.v is None or motion.a is None:
        terminal.say(f"{path}: its {missing} are those of a spline of degree 5 through the samples")
    return Segment(motion.name, *through_samples(motion.t, motion.q, motion.v, motion.a))


def _measured(terminal: Terminal, path: Path, robot: "Robot", spec: "Spec") -> "list[PreparedRun]":
    from excite_cli.cli.setup import load_dataset
    from excite_cli.identification.prepare import prepare
    from excite_cli.identification.processing import choose_processing

    data = load_dataset(terminal, robot, spec, [path])
    processing = choose_processing(data.runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    terminal.say(f"{path}: measured positions, filtered as for identification, taken as motions")
    return [prepare(run, processing) for run in data.runs]
