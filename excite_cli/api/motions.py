"""Motions of any origin: results, formats of controllers, measured data, trajectories at hand."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case, dataset_of, load_data
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.base_channel import channels_of_base
from excite_cli.measurement.dataset import Dataset
from excite_cli.motion_formats.catalogue import motion_format_of, read_motion
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.store.diagnosis_file import is_diagnosis
from excite_cli.store.fit_file import is_fit
from excite_cli.store.result_file import is_result, read_result
from excite_cli.summary import motions as motions  # how they are shown
from excite_cli.summary.pairs import doubts_in_words
from excite_cli.trajectory.catalogue import build_trajectory
from excite_cli.trajectory.fade import Segment
from excite_cli.trajectory.sampled import through_samples

Motions = Result | Segment | Sequence[Segment] | Dataset | str | Path

# Share of the position limits from which positions are taken for another unit.
_FAR_BEYOND = 4.0


@checked("motions")
def load_motions(
    problem: Problem | Case,
    motions: Motions,
    chosen: Sequence[int] = (),
    tell: Tell = log_note,
) -> list[Segment]:
    """Motions of the problem's robot, joints in its order; `chosen` of a result's by their index.

    `motions` are a result, trajectories with their coefficients, measured data, whose runs are
    taken, filtered as for identification, or a file: of these, or in a format of a controller (CSV,
    .npz, ROS 2, MoveIt, rosbag2).

    Raises
    ------
    FileError
        A file cannot be read; the motions are of another robot, or coefficients do not fit; a
        chosen motion is missing.
    """
    robot = problem.robot
    if isinstance(motions, Result):
        return _of_result(robot, motions, "the result", chosen, tell)
    if isinstance(motions, Segment):
        return [_fitting(robot, motions)]
    if isinstance(motions, Dataset):
        return _measured(problem, dataset_of(problem, motions))
    if not isinstance(motions, str | Path):
        return [_fitting(robot, each) for each in _listed(motions)]
    path = Path(motions)
    if is_result(path):
        return _of_result(robot, read_result(path), str(path), chosen, tell)
    if path.is_file() and (is_fit(path) or is_diagnosis(path)):
        read_result(path)  # tells that these are no motions
    if chosen and list(chosen) != [1]:
        raise FileError(f"--motion {chosen[0]}: {path} is not a result file; it holds one motion.")
    if is_motion(path, problem.spec):
        return [_motion(path, robot, tell)]
    data = load_data(problem, path, tell)
    text = f"{path}: measured positions, filtered as for identification, taken as motions"
    tell(Note(Level.INFO, text))
    return _measured(problem, data)


@checked()
def motions_of(
    result: Result, chosen: Sequence[int] = (), name: str = "the result"
) -> list[Segment]:
    """The motions of a result, or those `chosen` by their index, to be sampled, checked, exported.

    Each has a `trajectory` and `coefficients` (K, n): `q, v, a = motion.trajectory.states(t,
    motion.coefficients)` with t (T,) in s and (T, n) in rad, rad/s, rad/s². The trajectory is the
    one that the result itself says they have; messages call it `name`.

    Raises
    ------
    FileError
        There are none, one that is chosen is missing, or coefficients do not fit.
    """
    stored = parse_spec(result.config, f"the config stored in {name}")
    trajectory = build_trajectory(stored.trajectory)
    there = {motion.index: motion for motion in result.motions}
    if not there:
        raise FileError(f"{name} holds no motion. Make some with `excite optimize`.")
    for index in chosen:
        if index not in there:
            raise FileError(
                f"{name} has no motion {index}; it has {', '.join(map(str, there))} (--motion)."
            )
    shape = (trajectory.n_coefficients, len(result.joint_names))
    if any(motion.coefficients.shape != shape for motion in there.values()):
        raise FileError(f"{name}: coefficients do not have the shape {shape} of its trajectory.")
    return [
        Segment(f"motion_{index}", trajectory, there[index].coefficients)
        for index in dict.fromkeys(chosen or there)
    ]


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


def tell_doubts(result: Result, name: str, tell: Tell) -> None:
    """Say which motions of a result, called `name`, do not count as proved."""
    for each in doubts_in_words(result.doubted()):
        tell(Note(Level.WARNING, f"{name}: {each}."))


def _of_result(
    robot: Robot, result: Result, name: str, chosen: Sequence[int], tell: Tell
) -> list[Segment]:
    if result.joint_names != robot.joint_names:
        raise FileError(
            f"{name} moves other joints than the config: {', '.join(result.joint_names)}. Take "
            "the config that the motions were made with."
        )
    tell_doubts(result, name, tell)
    return motions_of(result, chosen, name)


def _listed(motions: object) -> list[object]:
    if isinstance(motions, Iterable):
        return list(motions)
    return [motions]


def _fitting(robot: Robot, motion: object) -> Segment:
    """The motion, once its coefficients are those of its trajectory and of the robot's joints."""
    if not isinstance(motion, Segment):
        raise FileError(
            f"{type(motion).__name__} is not a motion. Motions are a result, what "
            "motions_of(result) gives, Segments, or a file."
        )
    shape = (motion.trajectory.n_coefficients, robot.n)
    given = np.shape(motion.coefficients)
    if given != shape:
        raise FileError(
            f"{motion.name} has coefficients of the shape {given}; its trajectory and the "
            f"{robot.n} joints of {robot.name} ask for {shape}. Take the config that the motions "
            "were made with."
        )
    coefficients = np.asarray(motion.coefficients)
    if coefficients.dtype.kind not in "fiu" or not np.isfinite(coefficients).all():
        raise FileError(f"{motion.name} has coefficients that are no finite numbers.")
    return replace(motion, coefficients=coefficients.astype(float))


def _motion(path: Path, robot: Robot, tell: Tell) -> Segment:
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


def _measured(problem: Problem | Case, data: Dataset) -> list[Segment]:
    spec = problem.spec
    processing = choose_processing(data.runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    runs = prepare_all(data.runs, processing)
    own = slice(data.runs[0].base_rows, None)  # what is planned are motions of the joints
    return [
        Segment(run.run.key, *through_samples(run.t, run.q[:, own], run.v[:, own], run.a[:, own]))
        for run in runs
    ]
