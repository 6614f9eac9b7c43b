"""Runs of a log as a simulator plays them on an exported model: for `replay` and `score`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.api.model import Model
from excite_cli.api.model_exports import for_simulators
from excite_cli.errors import FileError, RobotError
from excite_cli.export.drive import Drive, drive_of
from excite_cli.export.mjcf import mjcf
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.stored_model import StoredModel
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array, Robot
from excite_cli.scoring.records import HorizonDrift
from excite_cli.simulation.mujoco_model import load_mujoco
from excite_cli.simulation.replay import ReplayInput
from excite_cli.simulation.set_point_replay import SetPointInput, horizon_errors


@dataclass(frozen=True)
class SimulatedModel:
    """A stored model as MJCF `text`; set points go to its `drive`, without one it gets torques.

    The delay of the drive is not in the text. `notes`: what the text cannot hold.
    """

    text: str
    drive: Drive | None
    notes: tuple[str, ...]


def simulated_model(stored: StoredModel) -> SimulatedModel:
    """As exported to simulators.

    Raises
    ------
    RobotError, MissingExtraError
        MuJoCo refuses the model; it is not installed.
    """
    mujoco, drive = load_mujoco(), drive_of(stored.spec, stored.robot.joint_names)
    simple, notes = for_simulators(stored, "mjcf")
    at_once = None if drive is None else replace(drive, delay=0.0)
    exported = mjcf(stored.robot, simple, at_once)
    try:
        mujoco.MjModel.from_xml_string(exported.text)
    except ValueError as refused:
        raise RobotError(f"MuJoCo refuses the model of {stored.path}: {refused}") from refused
    return SimulatedModel(exported.text, drive, (*notes, *exported.notes))


def drift_of(
    model: Model, simulated: SimulatedModel, runs: Sequence[tuple[Run, PreparedRun]]
) -> tuple[HorizonDrift, ...]:
    """How far the model is from the robot so long after starts from measured states of `runs`.

    Raises
    ------
    FileError
        A run has no set points, and the drives follow some.
    """
    robot, drive = model.made.robot, simulated.drive
    played: list[SetPointInput | ReplayInput] = []
    for run, prepared in runs:
        if drive is None:
            played.append(torques(robot, prepared, of_robot(model, prepared)))
        else:
            sent = set_points(robot, drive, run, prepared)
            played.append(replace(sent, sent=sent.sent + drive.delay))
    own = {name: robot.tree.joint_names.index(name) for name in robot.joint_names}

    def by_joint(values: Array) -> dict[str, float]:
        return {name: float(values[j]) for name, j in own.items()}

    return tuple(
        HorizonDrift(
            each.horizon,
            len(each.drift),
            by_joint(np.median(each.drift, axis=0)),
            by_joint(each.drift.max(axis=0)),
            by_joint(np.median(each.still, axis=0)),
            by_joint(np.median(each.steady, axis=0)),
        )
        for each in horizon_errors(simulated.text, played)
    )


def torques(robot: Robot, run: PreparedRun, torque: Array) -> ReplayInput:
    """The run with this `torque` (T, n); joints that follow others get none."""
    if robot.coupling is None:
        return ReplayInput(run.t, run.q, run.v, torque)
    every = np.zeros((len(run.t), robot.tree.n))
    every[:, np.array(robot.model_joints) - robot.first_joint] = torque
    return ReplayInput(run.t, robot.all_positions(run.q), robot.all_rates(run.v), every)


def of_robot(model: Model, run: PreparedRun) -> Array:
    """The robot's torque (T, n): what was measured, less what the model holds for its defects."""
    stored = model.made
    defects = tuple(effect for effect in stored.model.effects if effect.data_defect)
    whole = stored.model.predicted(stored.robot, run).torque
    return run.tau_raw - (whole - stored.model.without(defects).predicted(stored.robot, run).torque)


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
