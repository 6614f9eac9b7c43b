"""Configs, problems and measured data: what every command begins with."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.api.arguments import checked, paths_in, refuse_twice
from excite_cli.api.foreign_motions import is_motion, measured_motions, read_segment
from excite_cli.base_link.wrench_rows import with_base
from excite_cli.checks.bodies import bodies_in_words
from excite_cli.config.load_spec import files_of_config, load_spec, parse_spec, spec_of
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.errors import FileError
from excite_cli.excitation.admissible import worst_margins
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.result import Result, matches
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.covariates import with_declared
from excite_cli.measurement.dataset import Dataset, Finding, merged
from excite_cli.measurement.motors import motors_of
from excite_cli.measurement.quality import raise_for_errors
from excite_cli.measurement.torque import with_torques
from excite_cli.robot.description import is_named
from excite_cli.robot.model import Array, Robot, build_measured_robot, build_robot
from excite_cli.robot.overview import describe
from excite_cli.shown.answer import Shown, show
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.store.fit_file import fit_knowledge, read_fit
from excite_cli.summary.log_inspection import runs_in_words
from excite_cli.summary.problem_notes import problem_notes
from excite_cli.summary.robots import robot_parts

# The problem of a result, from the config that the result holds.


def with_own_margins(result: Result, problem: Problem) -> Result:
    """The result, with margins taken anew of motions that its own may not be of."""
    doubted = {motion.index: motion for motion in result.doubted()}
    motions = (
        replace(doubted[m.index], margins=worst_margins(problem, m.coefficients))
        if m.index in doubted
        else m
        for m in result.motions
    )
    return replace(result, motions=tuple(motions))


def rebuilt_problem(
    result: Result, config: str | Path | None = None, name: str = "the result"
) -> Problem:
    """The problem that `result` was made for; `config` says where relative paths start.

    Messages call the result `name`.

    Raises
    ------
    FileError
        The file holds no motion, its URDF is not found, or the robot is not the one it had.
    """
    if not result.motions:
        raise FileError(f"{name} holds no motion yet. Go on with `excite optimize --resume`.")
    spec = parse_spec(result.config, f"the config stored in {name}")
    folder = Path(result.config_folder)
    if config is not None:
        folder, given = Path(config).resolve().parent, load_spec(Path(config)).robot
        found = {name: getattr(given, name) for name in ("urdf", "package_dirs", "xacro_args")}
        spec = spec.model_copy(update={"robot": spec.robot.model_copy(update=found)})
    urdf = spec.robot.urdf
    if not is_named(urdf) and not (folder / urdf).is_file():
        raise FileError(
            f"{name} was made with the URDF {urdf}, and there is none at "
            f"{(folder / urdf).resolve()}. Relative paths start from the config: give the YAML "
            "file it was made with, --config CONFIG.yaml."
        )
    problem = build_problem(spec, folder, fit_knowledge(spec, folder))
    reason = matches(problem, result)
    if reason:
        raise FileError(
            f"{name} does not fit the robot that was found ({urdf}): {reason}. Give the YAML file "
            "it was made with, --config CONFIG.yaml, and the URDF as it was."
        )
    return problem


# Share of a joint's torque on held-out data from which a fit is doubted.
_MUCH_LEFT = 0.1
_WORK = 500  # states of a log or plan that stand for all of them
# A YAML file, or what it would hold.
Config = str | Path | Mapping[str, Any]
_LEVELS = {"note": Level.NOTE, "warning": Level.WARNING}


@dataclass(frozen=True, repr=False)
class Case(Shown):
    """What a config declares of a robot: enough for measured data, without anything to plan.

    Relative paths of `spec` start from `folder`, where `file` lies if it was read from one. A
    `Problem` has all of this too, and can be given wherever a case is expected.
    """

    spec: Spec
    folder: Path
    robot: Robot
    file: Path | None = None

    @cached_property
    def base(self) -> BaseParameters:
        """Base parameters of the robot."""
        return find_base_parameters(self.robot)


def measured_case(problem: Problem | Case) -> Problem | Case:
    """The case whose robot is that of the data: with `base` among robot.rows its base moves."""
    rows = problem.spec.robot.rows
    if "base" not in rows or problem.robot.base_joints:
        return problem
    robot = build_measured_robot(problem.spec.robot, problem.folder)
    return Case(problem.spec, problem.folder, robot, problem.file)


def robot_base(problem: Problem | Case) -> BaseParameters:
    """Base parameters of the robot, also of a problem that is planned for its load alone."""
    if isinstance(problem, Case) or problem.spec.criterion.of == "robot":
        return problem.base
    return find_base_parameters(problem.robot)


show(
    Case,
    lambda case: f"{case.robot.name}: {case.robot.n} joints",
    lambda case: robot_parts(describe(case.robot)),
)


@checked()
def load_case(config: Config, overrides: Sequence[str] = ()) -> Case:
    """The robot and declared model of a config, without capsules; `overrides` as with `--set`.

    Instead of a file, `config` may be a dict, as for `load_problem`.

    Raises
    ------
    ConfigError, RobotError
        The file says what is not allowed; the URDF is missing or wrong.

    Examples
    --------
    >>> load_case("configs/smoke.yaml").robot.joint_names[:2]
    ('shoulder_yaw', 'shoulder_pitch')
    """
    spec, folder, file = _given(config, overrides)
    return Case(spec, folder, build_robot(spec.robot, folder), file)


@checked()
def load_problem(config: Config, overrides: Sequence[str] = (), tell: Tell = log_note) -> Problem:
    """The whole problem of a config: robot, trajectory, criterion, constraints, grids.

    `config` is a YAML file or, put together in Python, a dict of what such a file would hold, where
    arrays and paths are allowed too; its relative paths start from the working directory.
    `overrides` are `key.path=value`, as with `--set`. Capsules of a robot that is new to this
    machine are fitted first, which takes seconds to a minute, and kept in the cache. `tell` hears
    what was understood, and what a person must know of it.

    Raises
    ------
    ConfigError, RobotError, FileError
        The config cannot be; the URDF is missing or wrong; the file of `uncertainty.fit` is.

    Examples
    --------
    >>> load_problem("configs/smoke.yaml", ["sequence.motions=1"]).variables
    45
    >>> load_problem({"robot": {"urdf": "data/smoke_arm.urdf"}, "seed": 2}).robot.n
    5
    """
    return _built(*_given(config, overrides), tell)


def _given(config: Config, overrides: Sequence[str]) -> tuple[Spec, Path, Path | None]:
    """What a config says, the folder that its paths start from, and its file if it is one."""
    if isinstance(config, Mapping):
        return spec_of(config, list(overrides)), Path.cwd(), None
    file = Path(config).resolve()
    return load_spec(Path(config), list(overrides)), file.parent, file


def problem_of(case: Problem | Case, tell: Tell = log_note) -> Problem:
    """The whole problem of a case, for what needs its constraints; see `load_problem`."""
    if isinstance(case, Problem):
        return case
    return _built(case.spec, case.folder, case.file, tell)


def _built(spec: Spec, folder: Path, file: Path | None, tell: Tell) -> Problem:
    work = states_of_work(spec, folder, tell)
    words = "base parameters, limits and collision geometry (up to two minutes for a new robot)"
    tell(Note(Level.STEP, f"preparing {words}"))
    problem = replace(build_problem(spec, folder, fit_knowledge(spec, folder), work), file=file)
    for note in problem_notes(problem):
        tell(note)
    if spec.uncertainty is not None and spec.uncertainty.fit is not None:
        _doubt_fit(folder / spec.uncertainty.fit, tell)
    return problem


def with_spec(problem: Problem, spec: Spec) -> Problem:
    """The problem that `spec` asks for in place of its own, with the same work and files."""
    fit = fit_knowledge(spec, problem.folder)
    built = build_problem(spec, problem.folder, fit, problem.work)
    return replace(built, file=problem.file)


def states_of_work(spec: Spec, folder: Path, tell: Tell) -> tuple[Array, Array, Array] | None:
    """q, v, a (N, n) of the log or the plan that `task` names; None where it names none.

    Raises
    ------
    FileError
        The file cannot be read, or holds other joints.
    """
    name = spec.task.log or spec.task.plan
    if name is None:
        return None
    path, key = folder / name, "log" if spec.task.log else "plan"
    if not path.is_file():
        raise FileError(f"task.{key}: there is no file {path}. Give one, or leave the key out.")
    case = Case(spec, folder, build_robot(spec.robot, folder))
    if is_motion(path, spec):
        motions = [read_segment(path, case.robot, tell)]
    else:
        motions = measured_motions(spec, load_data(case, path, tell))
    seconds = sum(each.trajectory.duration for each in motions)
    parts = []
    for each in motions:
        duration = each.trajectory.duration
        times = np.linspace(0.0, duration, max(2, round(_WORK * duration / seconds)))
        parts.append(each.trajectory.states(times, each.coefficients))
    q, v, a = (np.concatenate(series) for series in zip(*parts, strict=True))
    return q, v, a


def _doubt_fit(path: Path, tell: Tell) -> None:
    """Warn where a fit leaves much unexplained: its deviations say nothing of that."""
    errors = read_fit(path).error.relative_moving
    much = {joint: error for joint, error in errors.items() if error > _MUCH_LEFT}
    if much:
        worst = max(much, key=lambda joint: much[joint])
        text = (
            f"{path} leaves {100 * much[worst]:.0f} % of the torque of {worst} "
            f"unexplained ({len(much)} joints above {100 * _MUCH_LEFT:.0f} %). Its standard "
            "deviations do not cover an effect that the model lacks: run `excite diagnose` first."
        )
        tell(Note(Level.WARNING, text))


@checked()
def load_data(
    problem: Problem | Case,
    files: Dataset | str | Path | Sequence[str | Path],
    tell: Tell = log_note,
) -> Dataset:
    """Measured data of the robot, converted as `measurement` of the config says, and checked.

    Files are HDF5, CSV, MATLAB's, parquet or bags; `Dataset.from_arrays` and `from_frame` take
    what is at hand in Python. Runs have t (T,) in s, q (T, n) in rad (m), tau
    (T, n) in N·m (N); `findings` tell what was noticed (gaps, jitter, dead channels …), and so does
    `tell`.

    Raises
    ------
    FileError
        A file cannot be read, is given twice, or holds what no fit should be made of.
    ConfigError, MissingExtraError
        The config names what the file lacks; the library for bags is not installed.
    """
    if isinstance(files, Dataset) and not files.as_given:
        return dataset_of(problem, files, tell)
    problem = measured_case(problem)
    robot = problem.robot
    tell(Note(Level.STEP, "reading and checking the data"))
    data = as_recorded(problem, files)
    raise_for_errors(data)
    data = completed(problem, data)
    tell(Note(Level.INFO, f"{robot.name}: {robot.n} joints; {runs_in_words(data)}"))
    if isinstance(problem, Case):  # a problem has told it
        if problem.base.note:
            tell(Note(Level.NOTE, problem.base.note))
        if bodies := bodies_in_words(robot):
            tell(Note(Level.WARNING, f"{bodies}."))
    tell_findings(data.findings, tell)
    return data


def as_recorded(
    problem: Problem | Case, files: Dataset | str | Path | Sequence[str | Path]
) -> Dataset:
    """What files or given data hold, converted and checked; findings that forbid its use, too.

    Raises
    ------
    FileError, ConfigError, MissingExtraError
        As `load_data`, but for what its checks find.
    """
    given: Dataset | list[Path]
    if isinstance(files, Dataset):
        given = files
    else:
        given = [Path(each) for each in ([files] if isinstance(files, str | Path) else files)]
        refuse_twice(given)  # a run that is fitted must not be the held-out one, too
    robot, limits, spec = problem.robot, problem.robot.limits, problem.spec.measurement
    own = slice(robot.base_joints, None)
    return read_dataset(
        given,
        spec,
        robot.joint_names[own],
        (limits.lower[own], limits.upper[own], limits.velocity[own], limits.effort[own]),
        (~robot.sliding[own]).astype(float),
        motors_of(problem.spec.robot.transmissions, robot.joint_names[own]),
        problem.spec.robot.rows,
    )


def completed(problem: Problem | Case, data: Dataset) -> Dataset:
    """With the joints of a base, and the weight that a controller took off."""
    robot, spec = problem.robot, problem.spec.measurement
    if robot.base_joints:
        torques = "joints" in problem.spec.robot.rows
        data, noticed = with_base(robot, data, spec, torques)
        data = replace(data, findings=(*data.findings, *noticed))
    return _with_gravity(robot, data) if spec.gravity == "subtracted" else data


def _with_gravity(robot: Robot, data: Dataset) -> Dataset:
    """Torques from which a controller subtracted gravity, made whole again with the URDF's.

    Right where the controller's model is the URDF; what its masses are off by, the torque is.
    """
    dynamics = InverseDynamics(robot)
    runs = []
    for run in data.runs:
        rest = np.zeros_like(run.q)
        # Rounding is that of what was recorded: the sum comes in no steps.
        runs.append(replace(run, tau=run.tau + dynamics.torques(run.q, rest, rest)))
    return replace(data, runs=tuple(runs))


def inputs_of(problem: Problem | Case, *given: object) -> list[Path]:
    """What is read for the problem: files that are `given`, its config, and those that it names."""
    return [*paths_in(*given), *files_of_config(problem.spec, problem.folder, problem.file)]


def sources_of(data: Dataset | str | Path | Sequence[str | Path]) -> tuple[str, ...]:
    """The files that data come from."""
    if isinstance(data, Dataset):
        return data.sources
    return (str(data),) if isinstance(data, str | Path) else tuple(map(str, data))


def dataset_of(
    problem: Problem | Case,
    data: Dataset | str | Path | Sequence[str | Path],
    tell: Tell = log_note,
) -> Dataset:
    """Measured data of the robot: those at hand, or as `load_data` reads them.

    Raises
    ------
    FileError, ConfigError, MissingExtraError
        The data are of other joints, or lack a declared column; see `load_data`.
    """
    if not isinstance(data, Dataset) or data.as_given:
        return load_data(problem, data, tell)
    problem = measured_case(problem)
    joints, base = problem.robot.joint_names, problem.robot.base_joints
    if base and data.joint_names == joints[base:]:
        torques = "joints" in problem.spec.robot.rows
        data, found = with_base(problem.robot, data, problem.spec.measurement, torques)
        tell_findings(found, tell)
    if data.joint_names != joints:
        raise FileError(
            f"the data are of other joints ({', '.join(data.joint_names)}) than the config "
            f"({', '.join(joints)}). Read them with `load_data` and this config."
        )
    if not data.runs:
        raise FileError("the data hold no run. Give one, or read them with `load_data`.")
    data = with_torques(data, problem.spec.measurement)
    for run in data.runs:
        if not all(np.isfinite(values).all() for values in (run.t, run.q, run.tau)):
            raise FileError(
                f"run '{run.label}': time, positions or torques are NaN or infinite. `load_data` "
                "fills and masks such samples in files; take them out of data of your own."
            )
    return with_declared(data, problem.spec.measurement.covariates)


def tell_findings(findings: Iterable[Finding], tell: Tell) -> None:
    """What was noticed, each kind in one sentence."""
    for found in merged(findings):
        tell(Note(_LEVELS[found.severity], found.text, found.run))
