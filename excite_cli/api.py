"""What the commands do, for scripts and notebooks: one function for one command.

Every function takes what an earlier one gave and returns a frozen record; nothing is kept.

    problem = load_problem("configs/ur10.yaml")
    result = plan(problem)                              # excite optimize
    recording = simulate(problem, result)               # excite simulate, or: load_data(problem, …)
    found = diagnose(problem, recording.dataset)        # excite diagnose

Matrices here are small, and several BLAS threads make them slower: set OPENBLAS_NUM_THREADS=1
before Python starts. (The program takes one thread by itself.)
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from excite_cli.atomic import write_text_atomically
from excite_cli.config.inputs import files_of_config
from excite_cli.config.load import load_spec, parse_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.diagnose import diagnose as diagnose_dataset
from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.diagnosis.next_motion import NextMotion
from excite_cli.diagnosis.next_motion import plan_after as after_diagnosis
from excite_cli.diagnosis.plausibility import check_dataset
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.dynamics.base_parameters import BaseParameters, find_base_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import FileError
from excite_cli.excitation.admissible import path_of
from excite_cli.excitation.inspection import Inspection, Look, inspect, mesh_check_of
from excite_cli.excitation.planned_prior import planned_stack
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.progress import Progress
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.sequence import Step
from excite_cli.excitation.stack import Stack
from excite_cli.export.found_config import found_config
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.identification.identify import Identification
from excite_cli.identification.identify import identify as identify_dataset
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.quality import raise_for_errors
from excite_cli.proposal.propose import Proposal, Request
from excite_cli.proposal.propose import propose as propose_config
from excite_cli.robot.model import Robot, build_robot
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.planted import parse_planted
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation, takes_of
from excite_cli.simulation.simulate import simulate as simulate_motions
from excite_cli.store.diagnosis_file import write_diagnosis
from excite_cli.store.fit_file import write_fit
from excite_cli.store.fit_knowledge import fit_knowledge
from excite_cli.store.result_file import read_result, write_result
from excite_cli.store.versions import versions
from excite_cli.trajectory.catalogue import build_trajectory
from excite_cli.trajectory.chain import Segment
from excite_cli.workers.base import Workers

PlanProgress = Callable[[int, Progress], None]
Prior = str | Path | Result | Dataset | Segment | Stack


@dataclass(frozen=True)
class Case:
    """What a config declares of a robot: enough for measured data, without anything to plan.

    `base`: its base parameters. Relative paths of `spec` start from `folder`. A `Problem` has all
    of this too, and can be given wherever a case is asked for.
    """

    spec: Spec
    folder: Path
    robot: Robot
    base: BaseParameters


def propose(
    urdf: str | Path,
    folder: str | Path = ".",
    *,
    joints: Sequence[str] = (),
    base: Literal["fixed", "floating"] = "fixed",
) -> Proposal:
    """A config for a robot of which nothing but the URDF is known: `excite init`.

    `urdf` is a path (relative to `folder`, where the config will lie) or
    `example-robot-data:<name>`; `joints` those to move, none for a choice of ours. The `text` of
    what is returned is the YAML file, `notes` say what was chosen and why.

    Raises
    ------
    RobotError, ConfigError
        The robot lacks what a plan needs; a joint is unknown.
    NoAdmissibleMotionError
        No posture of the robot is clear of its limits.

    Examples
    --------
    >>> propose("data/smoke_arm.urdf").joints[:2]
    ('shoulder_yaw', 'shoulder_pitch')
    """
    return propose_config(Request(str(urdf), Path(folder), tuple(joints), base))


def load_case(config: str | Path, overrides: Sequence[str] = ()) -> Case:
    """The robot and declared model of a config, without capsules; `overrides` as with `--set`.

    Raises
    ------
    ConfigError, RobotError
        The file says what is not allowed; the URDF is missing or wrong.

    Examples
    --------
    >>> load_case("configs/smoke.yaml").robot.joint_names[:2]
    ('shoulder_yaw', 'shoulder_pitch')
    """
    spec, folder = load_spec(Path(config), list(overrides)), Path(config).resolve().parent
    robot = build_robot(spec.robot, folder)
    return Case(spec, folder, robot, find_base_parameters(robot))


def load_problem(config: str | Path, overrides: Sequence[str] = ()) -> Problem:
    """The whole problem of a config: robot, trajectory, criterion, constraints, grids.

    `overrides` are `key.path=value`, as with `--set`. Capsules of a robot that is new to this
    machine are fitted first, which takes seconds to a minute, and kept in the cache.

    Raises
    ------
    ConfigError, RobotError, FileError
        The config cannot be; the URDF is missing or wrong; the file of `uncertainty.fit` is.

    Examples
    --------
    >>> load_problem("configs/smoke.yaml", ["sequence.motions=1"]).variables
    45
    """
    spec, folder = load_spec(Path(config), list(overrides)), Path(config).resolve().parent
    return build_problem(spec, folder, fit_knowledge(spec, folder))


def plan(
    problem: Problem | NextMotion,
    *,
    priors: Sequence[Prior] = (),
    starts: Sequence[Segment] = (),
    output: str | Path | None = None,
    overwrite: bool = False,
    progress: PlanProgress = lambda motion, progress: None,
    workers: Workers | None = None,
) -> Result:
    """Motions one after the other, each with all earlier data stacked: `excite optimize`.

    Their number is `sequence.motions` of the config. With a `NextMotion` (see `plan_after`) the
    measured data of the diagnosis come first. `priors` are earlier results (or their files),
    measured data, or motions; the search of motion k starts from the k-th of `starts`. With
    `output` the result is on disk after every motion. `progress(k, state)` is called by the solver.
    `workers` (`open_workers`) share the starts of a motion, with the same result.

    Returns
    -------
    Result
        Its `motions` have `coefficients` (K, n), `condition_number`, `stacked_condition_number`,
        `margins` and what is `certified`.

    Raises
    ------
    NoAdmissibleMotionError
        There is none, or none was found; the message names what stands in the way.
    FileError
        A prior does not fit, or `output` exists.

    Examples
    --------
    >>> problem = load_problem("configs/smoke.yaml", ["optimizer.max_iterations=20"])
    >>> [motion.status for motion in plan(problem).motions]
    ['iteration limit', 'iteration limit']
    """
    path = Path(output) if output is not None else None
    following = problem if isinstance(problem, NextMotion) else None
    model = following.model if following else problem
    assert isinstance(model, Problem)
    read = [Path(prior) for prior in priors if isinstance(prior, str | Path)]
    read += files_of_config(model.spec, model.folder)
    refuse_inputs_as_outputs({"output": path}, read)
    if path is not None and path.exists() and not overwrite:
        raise FileError(f"{path} exists already. Give another name, or overwrite=True.")
    stacks: list[tuple[str, Result | Stack]] = []
    if following is not None:
        stacks.append(("the diagnosis", following.prior))
    stacks += [_stack_of(model, prior, k) for k, prior in enumerate(priors, start=1)]

    def store(step: Step, current: Result) -> None:
        if path is not None:
            write_result(path, current, model)

    return continue_run(
        following.problem if following else model,
        new_result(model, stacks, versions(), model.folder),
        lambda index: lambda state: progress(index, state),
        store,
        following.model if following else None,
        starts,
        workers,
    )


def _stack_of(problem: Problem, prior: Prior, number: int) -> tuple[str, Result | Stack]:
    if isinstance(prior, str | Path):
        return str(prior), read_result(Path(prior))
    name = f"prior {number}"
    if isinstance(prior, Dataset):
        return name, measured_stack(problem, prior)[0]
    if isinstance(prior, Segment):
        return name, planned_stack(problem, prior)[0]
    return name, prior


def plan_after(problem: Problem | Case, found: Diagnosis) -> NextMotion:
    """The problem of the next motion after a diagnosis, for `plan`: `excite optimize --after`.

    It separates effects that could not be told apart; if there are none, it excites the model with
    all effects found. `messages` of what is returned say which, and why.

    Raises
    ------
    FileError
        The diagnosis belongs to another robot.
    """
    spec, folder = problem.spec, problem.folder
    return after_diagnosis(found, spec, folder, fit_knowledge(spec, folder))


def motions_of(result: Result) -> list[Segment]:
    """The motions of a result, to be sampled, checked, simulated or exported.

    Each has a `trajectory` and `coefficients` (K, n): `q, v, a = motion.trajectory.states(t,
    motion.coefficients)` with t (T,) in s and (T, n) in rad, rad/s, rad/s².
    """
    trajectory = build_trajectory(parse_spec(result.config, "the result's config").trajectory)
    return [Segment(f"motion_{m.index}", trajectory, m.coefficients) for m in result.motions]


def check(
    problem: Problem,
    motions: Result | Sequence[Segment],
    *,
    rate: float = 1000.0,
    random: int = 0,
    meshes: bool = True,
) -> dict[str, Inspection]:
    """Every motion against every constraint, proved where it can be: `excite check`.

    Margins are taken at `rate` [Hz] and at `random` further instants; verdicts hold between them.

    Returns
    -------
    dict
        By the motion's name; `states` of each give (`proved` | `sampled` | `broken`, reason) by
        constraint, `margins` the worst margin with unit, place and time, `violations` their number.
    """
    checker = mesh_check_of(problem) if meshes else None
    look = Look(rate, random, problem.spec.seed)
    segments = motions_of(motions) if isinstance(motions, Result) else motions
    return {
        each.name: inspect(
            problem, path_of(problem, each.trajectory, each.coefficients), checker, look
        )
        for each in segments
    }


def simulate(
    problem: Problem | Case,
    motions: Result | Sequence[Segment],
    effects: Sequence[str] = (),
    settings: SimulationSettings = SimulationSettings(),
    *,
    declared: bool = True,
) -> Simulation:
    """Play motions on a MuJoCo robot that differs from its model: `excite simulate`.

    `effects` are put into the robot, as `kind@joint=value[,name:value…]`; with `declared` those of
    the config too, in sizes of their own. The `dataset` of what is returned is as if measured,
    `truth` what was in the robot, `tracking` the RMS error of each run (n,) in rad.

    Raises
    ------
    ConfigError, RobotError, MissingExtraError
        An effect cannot be read; the robot cannot be simulated; MuJoCo is missing.
    """
    segments = motions_of(motions) if isinstance(motions, Result) else motions
    planned = [PlannedMotion(each.name, each.trajectory, each.coefficients) for each in segments]
    takes = takes_of(planned, settings.repeat)
    planted = [p for text in effects for p in parse_planted(text, problem.robot, takes)]
    own = declared_effects(problem.spec.effects, problem.robot) if declared else ()
    return simulate_motions(problem.robot, planned, settings, planted, own)


def load_data(problem: Problem | Case, files: str | Path | Sequence[str | Path]) -> Dataset:
    """Measured data of the robot, converted as `measurement` of the config says, and checked.

    Files are HDF5, CSV or bags. Runs have t (T,) in s, q (T, n) in rad (m), tau (T, n) in N·m (N);
    `findings` tell what was noticed (gaps, jitter, dead channels …).

    Raises
    ------
    FileError
        A file cannot be read, or holds what no fit should be made of.
    ConfigError, MissingExtraError
        The config names what the file lacks; the library for bags is not installed.
    """
    paths = [files] if isinstance(files, str | Path) else files
    robot = problem.robot
    limits = (robot.limits.lower, robot.limits.upper, robot.limits.velocity, robot.limits.effort)
    data = read_dataset(
        [Path(each) for each in paths],
        problem.spec.measurement,
        robot.joint_names,
        limits,
        (~robot.sliding).astype(float),
    )
    raise_for_errors(data)
    return data


def identify(problem: Problem | Case, data: Dataset, sealed: str | None = None) -> Identification:
    """The parameters of the declared model: `excite identify`.

    `fit` of what is returned has `names`, `values` and `std` (P,), base parameters first, then
    those of effects; `error` is that on the run `sealed` (default: the last), which no fit saw.

    Raises
    ------
    ConfigError, FileError
        Config and data do not fit; a run is too short; order or signs of torques cannot be right.
    """
    check_dataset(problem.robot, data, problem.spec)
    return identify_dataset(problem.robot, problem.base, data, problem.spec, sealed)


def save_fit(path: str | Path, problem: Problem | Case, found: Identification) -> None:
    """Write a fit file, for `read_fit`, `excite export` and `uncertainty.fit`.

    Raises
    ------
    FileError
        It cannot be written.
    """
    own = files_of_config(problem.spec, problem.folder)
    refuse_inputs_as_outputs({"path": Path(path)}, own)
    config, folder = spec_as_yaml(problem.spec), str(problem.folder)
    write_fit(Path(path), found, config, folder, problem.robot.fingerprint())


def diagnose(
    problem: Problem | Case,
    data: Dataset,
    sealed: str | None = None,
    *,
    output: str | Path | None = None,
    progress: Callable[[str, int], None] = lambda text, done: None,
) -> Diagnosis:
    """What the declared model lacks: `excite diagnose`.

    Returns
    -------
    Diagnosis
        `effects` (kind, joints, parameters with standard deviations, p-value, aliases), `absorbed`,
        `unexplained`, and the errors `before` and `after` on the run `sealed` (default: the last),
        which nothing else saw. Written to `output` (HDF5) if that is given.

    Raises
    ------
    ConfigError, FileError
        Config and data do not fit; order or signs of torques cannot be right; data too short.
    """
    inputs = (*map(Path, data.sources), *files_of_config(problem.spec, problem.folder))
    refuse_inputs_as_outputs({"output": Path(output) if output is not None else None}, inputs)
    found = diagnose_dataset(problem.robot, problem.base, data, problem.spec, sealed, progress)
    found = replace(
        found,
        config=spec_as_yaml(problem.spec),
        config_folder=str(problem.folder),
        versions=versions(),
    )
    if output is not None:
        write_diagnosis(Path(output), found)
    return found


def save_config(path: str | Path, problem: Problem | Case, found: Diagnosis) -> None:
    """Write the config with the effects that a diagnosis found: `excite diagnose --apply`.

    Raises
    ------
    FileError
        It cannot be written.
    """
    own = files_of_config(problem.spec, problem.folder)
    refuse_inputs_as_outputs({"path": Path(path)}, own)
    text = found_config(problem.spec, problem.folder, found, Path(path))
    write_text_atomically(Path(path), text)
