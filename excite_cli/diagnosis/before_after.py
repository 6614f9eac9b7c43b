"""The declared model refitted, and the same with the effects that were found: errors and traces."""

from collections.abc import Sequence
from dataclasses import dataclass

from excite_cli.diagnosis.declared_model import Model, width_of
from excite_cli.diagnosis.tracing import Traced
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.catalogue import urdf_friction
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.identified_model import IdentifiedModel, Prediction, errors_on
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.torque_trace import TorqueTrace, torque_trace
from excite_cli.robot.model import Array, Robot
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell


@dataclass(frozen=True)
class Played:
    """Runs that models are tried on."""

    robot: Robot
    runs: Sequence[PreparedRun]

    def predictions(self, fitted: IdentifiedModel) -> list[Prediction]:
        """What a model says of every run."""
        return list(each(_predicted, (self.robot, fitted), self.runs))

    def errors(self, predictions: Sequence[Prediction]) -> Errors:
        """Errors of predictions for all runs."""
        return errors_on(self.robot, self.runs, predictions)

    def traces(
        self, before: Sequence[Prediction], after: Sequence[Prediction], sealed: bool
    ) -> tuple[TorqueTrace, ...]:
        """Torque over time, measured and by both predictions."""
        return tuple(
            torque_trace(run, new.load, new.torque, old.torque, sealed)
            for run, old, new in zip(self.runs, before, after, strict=True)
        )


def _predicted(shared: tuple[Robot, IdentifiedModel], run: PreparedRun, tell: Tell) -> Prediction:
    robot, fitted = shared
    return fitted.predicted(robot, run)


@dataclass(frozen=True)
class BeforeAfter:
    """Models on sealed runs: errors of both and of the untouched URDF, and torque over time.

    `by_urdf`: what the URDF predicts, for every run; empty (and `untouched` None) without masses.
    """

    before: Errors
    after: Errors
    untouched: Errors | None
    by_urdf: Sequence[Prediction]
    traces: tuple[TorqueTrace, ...]


def both_models(
    model: Model, traced: Traced, parameters: Array
) -> tuple[IdentifiedModel, IdentifiedModel]:
    """The declared model fitted to the training data, and the one with `parameters`."""
    found = _fitted(model, traced, traced.chosen, parameters)
    return refitted(model, traced, ()) if traced.chosen else found, found


def refitted(model: Model, traced: Traced, chosen: Sequence[int]) -> IdentifiedModel:
    """The model with these of the candidates, fitted to the training data."""
    return _fitted(model, traced, chosen, traced.fitted(chosen))


def _fitted(
    model: Model, traced: Traced, chosen: Sequence[int], parameters: Array
) -> IdentifiedModel:
    effects = (*model.declared, *(traced.candidates[i].effect for i in chosen))
    values = parameters[len(parameters) - width_of(effects) :]
    return IdentifiedModel(model.full_inertias(parameters), effects, values)


def on_sealed(
    played: Played, before: Sequence[Prediction], after: Sequence[Prediction]
) -> BeforeAfter:
    """Errors and torque over time of the sealed part, used once."""
    by_urdf = _by_urdf(played)
    return BeforeAfter(
        played.errors(before),
        played.errors(after),
        played.errors(by_urdf) if by_urdf else None,
        by_urdf,
        played.traces(before, after, sealed=True),
    )


def _by_urdf(played: Played) -> Sequence[Prediction]:
    """What the URDF says as given, with the friction of its <dynamics>; none if it has no mass."""
    phi = standard_parameters(played.robot)
    if not phi.any():
        return ()
    return played.predictions(IdentifiedModel(phi, *urdf_friction(played.robot)))
