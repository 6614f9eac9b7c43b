"""Torque that a fitted model predicts for a prepared run, and its errors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.identification.errors_of_torque import Errors, torque_errors
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import effect_columns, seen_of, with_effects
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class Prediction:
    """Of one run, (T, n) at the working rate: rigid-body torque, and all of it with the effects."""

    load: Array
    torque: Array


def predicted(
    body: RigidBody, effects: Sequence[Effect], values: Array, run: PreparedRun
) -> Prediction:
    """What a model says of the motion of a run; its inertias are the body's.

    Effects that look at the torque see the model's own.
    """
    load = body.load
    columns = effect_columns(effects, with_effects(seen_of(run, body), effects, values))
    return Prediction(load, np.asarray(load + columns @ values))


def errors_on(
    robot: Robot, runs: Sequence[PreparedRun], predictions: Sequence[Prediction]
) -> Errors:
    """Errors of the predictions for `runs`."""
    raw = [each.torque for each in predictions]
    return torque_errors(
        robot.joint_names,
        [run.tau for run in runs],
        [run.averaged_torque(each) for run, each in zip(runs, raw, strict=True)],
        [run.valid for run in runs],
        [run.moving & run.valid for run in runs],
        [run.tau_raw for run in runs],
        raw,
        runs[0].step,
    )
