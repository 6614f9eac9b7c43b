"""Torque that a fitted model predicts for a prepared run, and its errors."""

from collections.abc import Sequence

import numpy as np

from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.errors_of_torque import Errors, torque_errors
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import effect_columns
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.rigid_body import RigidBody

_SETTLED = 3


def predicted(
    robot: Robot, phi: Array, effects: Sequence[Effect], values: Array, run: PreparedRun, name: str
) -> Array:
    """τ (T, n) at the working rate; effects that look at the torque see the model's own."""
    body = RigidBody(robot, phi, run.q, run.v, run.a)
    load = body.load
    torque = load
    in_robot = np.repeat(
        [not effect.data_defect for effect in effects],
        [len(effect.parameters) for effect in effects],
    )
    total = load
    for _ in range(_SETTLED):
        signals = Signals(run.t, run.q, run.v, run.a, load, torque, body, name)
        columns = effect_columns(effects, signals)
        total = load + columns @ values
        if not len(effects):
            break
        torque = load + columns @ np.where(in_robot, values, 0.0)
    return np.asarray(total)


def errors_on(
    robot: Robot,
    phi: Array,
    effects: Sequence[Effect],
    values: Array,
    runs: Sequence[PreparedRun],
    names: Sequence[str],
) -> Errors:
    """Errors of the model on `runs`, whose names (without the block) are `names`."""
    raw = [
        predicted(robot, phi, effects, values, run, name)
        for run, name in zip(runs, names, strict=True)
    ]
    return torque_errors(
        robot.joint_names,
        [run.tau for run in runs],
        [run.averaged(each) for run, each in zip(runs, raw, strict=True)],
        [run.valid for run in runs],
        [run.moving & run.valid for run in runs],
        [run.tau_raw for run in runs],
        raw,
        runs[0].step,
    )
