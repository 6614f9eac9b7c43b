"""Recorded torques, or set points, played on an exported model: `excite replay`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case, dataset_of
from excite_cli.api.model import Model, load_model
from excite_cli.api.models import for_simulators
from excite_cli.api.scoring import recordings_of
from excite_cli.api.set_point_replaying import replay_set_points
from excite_cli.checks.all_checks import look, without_fault
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import urdf_friction
from excite_cli.errors import ConfigError, RobotError
from excite_cli.export.drive import drive_of
from excite_cli.export.exported import ModelText
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Array, Robot
from excite_cli.scoring.records import Replay, SetPointReplay
from excite_cli.scoring.score import Scorer
from excite_cli.shown.answer import Answer
from excite_cli.shown.note import Level, Note, Tell, log_note
from excite_cli.simulation.replay import ReplayInput, drift, inertias
from excite_cli.summary.set_point_replay import set_point_answer
from excite_cli.summary.simulation import replay_answer as torque_answer

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
        return replay_set_points(given, other, pairs, _described(robot))
    if beside is not None:
        raise ConfigError(
            f"--beside: only where set points are played, and the torque of {stored.path} was "
            "measured. Replay the other model by itself."
        )
    simple, notes = for_simulators(stored, "mjcf")
    exported = mjcf(robot, simple)
    q = np.concatenate([run.q for run in runs])
    postures = robot.all_positions(q[:: max(1, len(q) // _POSTURES)])
    inertia = inertias(exported.text, postures)
    lost: list[str] = []

    def deviation(text: str, played: list[ReplayInput], name: str) -> dict[str, float]:
        found = drift(text, [_of_all(robot, run) for run in played], inertia)
        if found.lost:
            lost.append(name)
        rms = dict(zip(robot.tree.joint_names, map(float, found.rms), strict=True))
        return {joint: rms[joint] for joint in robot.joint_names}

    before = None
    untouched = _urdf(robot)
    if isinstance(untouched, str):
        notes = (*notes, untouched)
    elif untouched is not None:
        as_measured = [_played(run, run.tau_raw) for run in runs]
        before = deviation(untouched.text, as_measured, "the URDF")
    after = deviation(
        exported.text, [_played(run, _of_robot(given, run)) for run in runs], "the model"
    )
    return Replay(
        str(stored.path),
        tuple(own),
        float(sum(run.t[-1] - run.t[0] for run in runs)),
        before,
        after,
        tuple(lost),
        tuple(n for n, s in zip(robot.joint_names, robot.sliding, strict=True) if s),
        (*notes, *exported.notes),
    )


def replay_answer(found: Replay | SetPointReplay) -> Answer:
    """What `excite replay` answers; status 1 where the deviation did not fall."""
    return set_point_answer(found) if isinstance(found, SetPointReplay) else torque_answer(found)


def _urdf(robot: Robot) -> ModelText | str | None:
    """The URDF as it is, why MuJoCo refuses it, or None where it has no masses."""
    described = _described(robot)
    if described is None:
        return None
    try:
        return mjcf(robot, described)
    except RobotError as refused:
        return f"the URDF is not played: {refused}"


def _described(robot: Robot) -> IdentifiedModel | None:
    """The URDF as it is, with the friction of its <dynamics>; None where it has no masses."""
    phi = standard_parameters(robot)
    if not phi.any():
        return None
    effects, values = urdf_friction(robot)
    return IdentifiedModel(phi, effects, values)


def _played(run: PreparedRun, torque: Array) -> ReplayInput:
    return ReplayInput(run.t, run.q, run.v, torque)


def _of_all(robot: Robot, run: ReplayInput) -> ReplayInput:
    """The run with the joints that follow others, which no motor drives."""
    if robot.coupling is None:
        return run
    torque = np.zeros((len(run.t), robot.tree.n))
    torque[:, np.array(robot.model_joints) - robot.first_joint] = run.torque
    return ReplayInput(run.t, robot.all_positions(run.q), robot.all_rates(run.v), torque)


def _of_robot(model: Model, run: PreparedRun) -> Array:
    """The robot's torque (T, n): what was measured, less what the model holds for its defects."""
    stored = model.made
    defects = tuple(effect for effect in stored.model.effects if effect.data_defect)
    whole = stored.model.predicted(stored.robot, run).torque
    return run.tau_raw - (whole - stored.model.without(defects).predicted(stored.robot, run).torque)
