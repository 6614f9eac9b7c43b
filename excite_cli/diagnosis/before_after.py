"""The declared model refitted, and the same with the effects that were found: errors and traces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.diagnosis.declared_model import Model, width_of
from excite_cli.diagnosis.prediction import Prediction, errors_on, predicted
from excite_cli.diagnosis.robust_fit import robust_solve
from excite_cli.diagnosis.tracing import Traced
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.torque_trace import TorqueTrace, torque_trace
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class FittedModel:
    """Inertias φ (P,), effects, and the values of all their linear parameters in order."""

    phi: Array
    effects: tuple[Effect, ...]
    values: Array


@dataclass(frozen=True)
class BeforeAfter:
    """Both models on some runs: errors, and torque over time."""

    before: Errors
    after: Errors
    traces: tuple[TorqueTrace, ...]


def both_models(model: Model, traced: Traced, parameters: Array) -> tuple[FittedModel, FittedModel]:
    """The declared model fitted to the training data, and the one with `parameters`."""
    declared = robust_solve(traced.data, traced.candidates, (), traced.levels)
    width, found = model.declared_width, width_of(traced.effects)

    def fitted(x: Array, effects: tuple[Effect, ...], count: int) -> FittedModel:
        return FittedModel(model.full_inertias(x), effects, x[len(x) - count :])

    return (
        fitted(declared, model.declared, width),
        fitted(parameters, (*model.declared, *traced.effects), width + found),
    )


def training_traces(
    robot: Robot, models: tuple[FittedModel, FittedModel], traced: Traced
) -> tuple[TorqueTrace, ...]:
    """Torque over time of the training parts."""
    return _compared(robot, models, traced.data.runs, sealed=False)[2]


def on_sealed(
    robot: Robot, models: tuple[FittedModel, FittedModel], runs: Sequence[PreparedRun]
) -> BeforeAfter:
    """Errors and torque over time of the sealed part, used once."""
    before, after, traces = _compared(robot, models, runs, sealed=True)
    return BeforeAfter(errors_on(robot, runs, before), errors_on(robot, runs, after), traces)


def _compared(
    robot: Robot,
    models: tuple[FittedModel, FittedModel],
    runs: Sequence[PreparedRun],
    sealed: bool,
) -> tuple[list[Prediction], list[Prediction], tuple[TorqueTrace, ...]]:
    before, after = ([_predicted(robot, fitted, run) for run in runs] for fitted in models)
    traces = tuple(
        torque_trace(run, new.load, new.torque, old.torque, sealed)
        for run, old, new in zip(runs, before, after, strict=True)
    )
    return before, after, traces


def _predicted(robot: Robot, fitted: FittedModel, run: PreparedRun) -> Prediction:
    body = RigidBody(robot, fitted.phi, run.q, run.v, run.a)
    values = fitted.values if len(fitted.effects) else np.zeros(0)
    return predicted(body, fitted.effects, values, run.t, run.run)
