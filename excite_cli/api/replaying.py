"""Recorded torques, or set points, played on an exported model: `excite replay`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case, dataset_of
from excite_cli.api.model import Model, load_model
from excite_cli.api.model_exports import for_simulators
from excite_cli.api.played_runs import of_robot, set_points, simulated_model, torques
from excite_cli.api.scoring import recordings_of
from excite_cli.checks.all_checks import look, without_fault
from excite_cli.errors import ConfigError, FileError, RobotError
from excite_cli.export.drive import Drive, drive_of
from excite_cli.export.exported import ModelText
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.identified_model import IdentifiedModel, as_described
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.stored_model import StoredModel
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Robot
from excite_cli.scoring.records import Replay, ReplayedModel, SetPointReplay
from excite_cli.scoring.score import Scorer
from excite_cli.shown.answer import Answer
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.simulation.replay import ReplayInput, drift, inertias
from excite_cli.simulation.set_point_replay import HORIZONS, set_point_errors
from excite_cli.summary.simulation import replay_answer as torque_answer
from excite_cli.summary.simulation import set_point_answer

_POSTURES = 40


@checked()
def replay(
    model: Model | str | Path,
    data: Dataset | str | Path | Sequence[str | Path],
    *,
    held_out: bool = False,
    beside: Model | str | Path | None = None,
    tell: Tell = log_note,
) -> Replay | SetPointReplay:
    """Recorded torques played on the exported model (MJCF), and on the URDF: `excite replay`.

    Of a robot whose drives follow set points (`measurement.torque: command`) these are played, on
    actuators as exported, also on a model `beside` it (of `identify`, say).
    `held_out`: of the data that the model was made of, only the part that was held out then.

    Returns
    -------
    Replay
        RMS deviations from the measured motion [rad] (m) by joint, `before` and `after`; a loose
        position loop, the same for both, holds the models (`excite_cli.simulation.replay`).
    SetPointReplay
        Deviations after 0.1, 1 and 10 s from the measured state, and over the whole log, with
        nothing that holds the models (`excite_cli.simulation.set_point_replay`).

    Raises
    ------
    FileError, ConfigError, RobotError, MissingExtraError
        See `Model.load` and `load_data`; the data contradict the robot's set-up; MuJoCo refuses
        the model, or is not installed.
    """
    given = model if isinstance(model, Model) else load_model(model)
    stored = given.made
    robot = stored.robot
    dataset = dataset_of(Case(stored.spec, stored.folder, robot), data, tell)
    own = recordings_of(dataset, stored.held_out_run if held_out else None, given)
    scorer = Scorer(stored)
    pairs = {
        name: [(run, each) for run in parts for each in scorer.prepared([run])]
        for name, parts in own.items()
    }
    runs = [each for parts in pairs.values() for _, each in parts]
    recorded = [run for parts in own.values() for run in parts]
    for each in without_fault(look(robot, recorded, runs, stored.spec)):
        if each.status == "doubt":
            tell(Note(Level.WARNING, each.evidence))
    if drive_of(stored.spec, robot.joint_names) is not None:
        other = load_model(beside) if isinstance(beside, str | Path) else beside
        return replay_set_points(given, other, pairs, as_described(robot))
    if beside is not None:
        raise ConfigError(
            f"--beside: only where set points are played, and the torque of {stored.path} was "
            "measured. Replay the other model by itself."
        )
    tell(Note(Level.STEP, "playing the recorded torques in MuJoCo"))
    exported = simulated_model(stored)
    notes = exported.notes
    q = np.concatenate([run.q for run in runs])
    postures = robot.all_positions(q[:: max(1, len(q) // _POSTURES)])
    inertia = inertias(exported.text, postures)
    lost: list[str] = []

    def deviation(text: str, played: list[ReplayInput], name: str) -> dict[str, float]:
        found = drift(text, played, inertia)
        if found.lost:
            lost.append(name)
        rms = dict(zip(robot.tree.joint_names, map(float, found.rms), strict=True))
        return {joint: rms[joint] for joint in robot.joint_names}

    before = None
    untouched = _urdf(robot)
    if isinstance(untouched, str):
        notes = (*notes, untouched)
    elif untouched is not None:
        as_measured = [torques(robot, run, run.tau_raw) for run in runs]
        before = deviation(untouched.text, as_measured, "the URDF")
    of_model = [torques(robot, run, of_robot(given, run)) for run in runs]
    after = deviation(exported.text, of_model, "the model")
    return Replay(
        str(stored.path),
        tuple(own),
        float(sum(run.t[-1] - run.t[0] for run in runs)),
        before,
        after,
        tuple(lost),
        tuple(n for n, s in zip(robot.joint_names, robot.sliding, strict=True) if s),
        notes,
    )


def replay_answer(found: Replay | SetPointReplay) -> Answer:
    """What `excite replay` answers; status 1 where the deviation did not fall."""
    return set_point_answer(found) if isinstance(found, SetPointReplay) else torque_answer(found)


def _urdf(robot: Robot) -> ModelText | str | None:
    """The URDF as it is, why MuJoCo refuses it, or None where it has no masses."""
    described = as_described(robot)
    if described is None:
        return None
    try:
        return mjcf(robot, described)
    except RobotError as refused:
        return f"the URDF is not played: {refused}"


# Recorded set points played on exported models: the part of `excite replay` without torques.

URDF = "URDF"  # the name of the robot as it was described


def replay_set_points(
    model: Model,
    beside: Model | None,
    recorded: Mapping[str, Sequence[tuple[Run, PreparedRun]]],
    untouched: IdentifiedModel | None,
) -> SetPointReplay:
    """Errors of the robot as described (`untouched`), of `beside` and of `model`.

    All with the gains, the limits and the delay of the drives of `model`; what the models hold for
    gains and offsets of their law is theirs.

    Raises
    ------
    FileError
        A log has no set points; `beside` is of another robot.
    """
    stored = model.made
    drive = drive_of(stored.spec, stored.robot.joint_names)
    assert drive is not None
    if beside is not None and beside.made.robot.fingerprint() != stored.robot.fingerprint():
        raise FileError(
            f"--beside {beside.made.path}: it is of another robot than {stored.path}. Give a model "
            "of the same URDF and the same joints."
        )
    played = [
        set_points(stored.robot, drive, run, prepared)
        for runs in recorded.values()
        for run, prepared in runs
    ]
    texts, notes = _texts(stored, beside, drive, untouched)
    models, starts = [], (0,) * len(HORIZONS)
    names = stored.robot.tree.joint_names
    own = [names.index(name) for name in stored.robot.joint_names]
    for name, text in texts.items():
        found = set_point_errors(text, played, drive.delay)
        after = {names[j]: tuple(map(float, found.after[:, j])) for j in own}
        whole = {names[j]: float(found.whole[j]) for j in own}
        models.append(ReplayedModel(name, after, whole, found.lost))
        starts = tuple(map(int, found.starts))
    slides = zip(stored.robot.joint_names, stored.robot.sliding, strict=True)
    return SetPointReplay(
        model=str(stored.path),
        names=tuple(recorded),
        seconds=float(sum(run.t[-1] - run.t[0] for run in played)),
        horizons=HORIZONS,
        starts=starts,
        models=tuple(models),
        sliding=tuple(name for name, sliding in slides if sliding),
        notes=notes,
    )


def _texts(
    stored: StoredModel,
    beside: Model | None,
    drive: Drive,
    untouched: IdentifiedModel | None,
) -> tuple[dict[str, str], tuple[str, ...]]:
    """MJCF by name, the model's last, without the delay (which is played); notes of that."""
    at_once, texts, notes = replace(drive, delay=0.0), {}, []
    if untouched is None:
        notes.append("the URDF has no masses and is not played")
    else:
        try:
            texts[URDF] = mjcf(stored.robot, untouched, at_once).text
        except RobotError as refused:
            notes.append(f"the URDF is not played: {refused}")
    if beside is not None:
        other, _ = for_simulators(beside.made, "mjcf")
        texts[str(beside.made.path)] = mjcf(beside.made.robot, other, at_once).text
    exported = simulated_model(stored)
    texts[str(stored.path)] = exported.text
    return texts, (*notes, *exported.notes)
