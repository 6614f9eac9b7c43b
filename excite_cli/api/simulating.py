"""Motions played on a robot that differs from its model: `excite simulate`."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.exported_chains import Start, entered, start_posture
from excite_cli.api.loading import Case, inputs_of, measured_case, problem_of
from excite_cli.api.motions import Motions, load_motions
from excite_cli.api.outputs import held
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.load_spec import spec_as_yaml
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem
from excite_cli.export.timed import repeated
from excite_cli.measurement.hdf5_writer import write_dataset
from excite_cli.measurement.torque import given_law
from excite_cli.robot.model import Robot
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.simulation.base_sensors import Instruments
from excite_cli.simulation.covariate_series import parse_series as parse_series
from excite_cli.simulation.ground_truth import parse_planted
from excite_cli.simulation.leading import LeadingSetPoints
from excite_cli.simulation.mujoco_model import load_mujoco
from excite_cli.simulation.planned_motion import Planned, PlannedMotion, PlannedProgram
from excite_cli.simulation.position_drive import PositionDrive as PositionDrive
from excite_cli.simulation.position_drive import parse_gains as parse_gains
from excite_cli.simulation.settings import SimulationSettings as SimulationSettings
from excite_cli.simulation.simulate import Simulation, takes_of
from excite_cli.simulation.simulate import simulate as simulate_motions
from excite_cli.store.own_file import versions
from excite_cli.summary.simulation import simulation_answer as simulation_answer
from excite_cli.trajectory.fade import Segment

# What of the config's measurement section changes neither positions nor torques when it is read.
_KEPT = {"filter", "topic", "rate", "covariates", "wrench", "base"}
_FAR = 0.2  # rad (m): a joint this far from its set point does not follow it


@checked("motions")
def simulate(
    problem: Problem | Case,
    motions: Motions,
    effects: Sequence[str] = (),
    settings: SimulationSettings = SimulationSettings(),
    *,
    chosen: Sequence[int] = (),
    start: Start | None = None,
    declared: bool = True,
    output: str | Path | None = None,
    overwrite: bool = False,
    progress: Callable[[str, int, int], None] = unheard,
    tell: Tell = log_note,
) -> Simulation:
    """Play motions on a MuJoCo robot that differs from its model: `excite simulate`.

    `effects` are put into the robot, as `kind@joint=value[,name:value…]`; with `declared` those of
    the config too, in sizes of their own. `chosen` are motions of a result by their index. With
    `start` (position by joint [rad, m], the others at robot.posture; {}: all of them) the robot
    enters each motion from rest there and goes back, within all constraints. Written to `output`
    (HDF5) if that is given. `progress(run, done, total)` is called before every run.

    Returns
    -------
    Simulation
        Its `dataset` is as if measured, `truth` what was in the robot, `tracking` the RMS error of
        each run (n,) in rad (m).

    Raises
    ------
    FileError
        The motions are of another robot, or cannot be read; `output` exists.
    ConfigError, RobotError, MissingExtraError
        An effect cannot be read; the robot cannot be simulated; MuJoCo is missing.
    NoAdmissibleMotionError
        No admissible way from `start` into a motion was found.
    """
    with held({"output": output}, overwrite, inputs_of(problem, motions)):
        load_mujoco()
        robot = measured_case(problem).robot
        whole = replace(robot, rows=robot.moved)  # friction is there, measured or not
        segments = load_motions(problem, motions, chosen, tell)
        if not segments:
            raise FileError("There is no motion to play.")
        planned, settings = _planned(problem, segments, settings, start, tell)
        takes = takes_of(planned, settings.repeat)
        planted = [each for text in effects for each in parse_planted(text, robot, takes)]
        own = declared_effects(problem.spec.effects, whole) if declared else ()
        if output is not None:
            _warn_of_reading(problem.spec.measurement, settings, tell)
        found = simulate_motions(
            robot,
            planned,
            settings,
            planted,
            own,
            Instruments(problem.spec.measurement, settings) if robot.base_joints else None,
            lambda run, done: progress(run, done, sum(map(len, takes.values()))),
        )
        _hint_at_lag(found, tell)
        _hint_at_limits(robot, planned, settings, tell)
        if output is not None:
            write_dataset(Path(output), found.dataset, _attributes(problem, found, settings))
        return found


def configured_drive(case: Problem | Case) -> PositionDrive | None:
    """The drive that follows set points as the config describes it; None where it has none.

    Raises
    ------
    ConfigError
        `measurement.command` names joints that the robot does not move, or what no drive has.
    """
    measurement = case.spec.measurement
    if measurement.torque != "command" or measurement.command.kp is None:
        return None
    law = given_law(measurement, case.robot.joint_names, "measurement.command")
    return PositionDrive.of_law(law, measurement.command.set_point_speeds)


def _planned(
    problem: Problem | Case,
    segments: Sequence[Segment],
    settings: SimulationSettings,
    start: Start | None,
    tell: Tell,
) -> tuple[list[Planned], SimulationSettings]:
    """What is played; periods of what is not periodic by itself are segments of a program."""
    motions: list[Planned] = [
        PlannedMotion(each.name, each.trajectory, each.coefficients) for each in segments
    ]
    if start is not None:
        posture = start_posture(problem.robot, start)
        whole = problem_of(problem, tell)
        chains = entered(whole, segments, posture, settings.periods, tell)
    elif settings.periods > 1 and not all(motion.periodic for motion in motions):
        joints = problem.robot.joint_names
        chains = [repeated(each, settings.periods, joints) for each in segments]
    else:
        return motions, settings
    programs = [PlannedProgram(m.name, chain) for m, chain in zip(segments, chains, strict=True)]
    return list(programs), replace(settings, periods=1)


def _warn_of_reading(
    measurement: MeasurementSpec, settings: SimulationSettings, tell: Tell
) -> None:
    """Reading the file with this config would change positions or torques, or find none."""
    plain, by_command = MeasurementSpec(), getattr(measurement, "torque", "") == "command"
    own = {"torque", "command"} if settings.drive is not None else set()
    if any(
        getattr(measurement, name) != getattr(plain, name)
        for name in MeasurementSpec.model_fields
        if name not in _KEPT | own
    ):
        text = (
            "the config converts recorded positions or torques (measurement: …), but this file "
            "holds rad and N·m at the joints. Read it with a config without that."
        )
        tell(Note(Level.WARNING, text))
    if by_command != (settings.drive is not None):
        text = (
            "this file holds set points (q_cmd) and no torques: read it with a config that has "
            "measurement.torque: command, and the drive's gains in measurement.command."
            if settings.drive is not None
            else "the config takes torques from set points (measurement.torque: command), but "
            "this file holds torques: simulate with --control position, or read it without that."
        )
        tell(Note(Level.NOTE, text))


def _hint_at_lag(found: Simulation, tell: Tell) -> None:
    """A robot that is far from its set points does not move as planned."""
    if not found.lag:
        return
    run, joint, error = found.farthest
    if error > _FAR:
        name = found.dataset.joint_names[joint]
        unit = "m" if found.truth.sliding[joint] else "rad"
        text = (
            f"'{name}' is up to {error:.2g} {unit} from its set points: what moves is not the "
            "planned motion, whose limits and clearances are not kept. Take larger --kp, or plan "
            "a slower motion."
        )
        tell(Note(Level.HINT, text, run))


def _hint_at_limits(
    robot: Robot, motions: Sequence[Planned], settings: SimulationSettings, tell: Tell
) -> None:
    """Set points that lead a motion stop at the joints' limits."""
    drive = settings.drive
    for motion in motions:
        sent = motion if drive is None else drive.sent_for(motion, robot)
        if isinstance(sent, LeadingSetPoints):
            note = sent.clipped(np.arange(0.0, motion.duration, sent.step), motion.name)
            if note is not None:
                tell(note)


def _attributes(
    problem: Problem | Case, found: Simulation, settings: SimulationSettings
) -> dict[str, object]:
    """What the data file says about its making."""
    truth = found.truth.record()
    columns = [each.name for each in settings.covariates]  # their values are in the runs
    return {
        "simulated": True,
        "seed": settings.seed,
        "settings": json.dumps({**asdict(replace(settings, covariates=())), "covariates": columns}),
        "truth": json.dumps(truth, ensure_ascii=False),
        "config": spec_as_yaml(problem.spec),
        "versions": json.dumps(versions()),
    }
