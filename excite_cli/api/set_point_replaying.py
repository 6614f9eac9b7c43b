"""Recorded set points played on exported models: the part of `excite replay` without torques."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.api.model import Model
from excite_cli.api.models import for_simulators
from excite_cli.errors import FileError, RobotError
from excite_cli.export.drive import Drive, drive_of
from excite_cli.export.exported import ModelText
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.stored_model import StoredModel
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array, Robot
from excite_cli.scoring.records import ReplayedModel, SetPointReplay
from excite_cli.simulation.set_point_replay import HORIZONS, SetPointInput, set_point_errors

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
    simple, more = for_simulators(stored, "mjcf")
    exported: ModelText = mjcf(stored.robot, simple, at_once)
    texts[str(stored.path)] = exported.text
    return texts, (*notes, *more, *exported.notes)


def set_points(robot: Robot, drive: Drive, run: Run, prepared: PreparedRun) -> SetPointInput:
    """What the drives got during `prepared`, a part of `run`, in the units of an actuator.

    Raises
    ------
    FileError
        The log has no set points.
    """
    if "q_cmd" not in run.extra:
        raise FileError(
            f"run '{run.label}' has no set points (q_cmd), which the drives of this model follow. "
            "Give the log with them (measurement.channels names its columns)."
        )
    ctrl = _held(run.extra["q_cmd"])
    if "v_cmd" in run.extra:
        ctrl = ctrl + drive.kd / drive.kp * _held(run.extra["v_cmd"])
    if "tau_ff" in run.extra:
        ctrl = ctrl + _held(run.extra["tau_ff"]) / drive.kp
    q, v = prepared.q, prepared.v
    if robot.coupling is not None:
        q, v = robot.all_positions(q), robot.all_rates(v)
    return SetPointInput(prepared.t, q, v, run.t, ctrl)


def _held(values: Array) -> Array:
    """(S, n), with the value before where one is missing."""
    found = np.array(values, dtype=float)
    newest = np.where(np.isfinite(found), np.arange(len(found))[:, None], 0)
    return np.take_along_axis(found, np.maximum.accumulate(newest, axis=0), axis=0)
