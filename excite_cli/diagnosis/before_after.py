"""The declared model and that with the effects that were found, on runs: errors and traces."""

from collections.abc import Sequence
from dataclasses import dataclass

from excite_cli.diagnosis.declared_model import width_of
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

    @property
    def by_urdf(self) -> Sequence[Prediction]:
        """What the URDF says as given, with the friction of its <dynamics>; none without masses."""
        phi = standard_parameters(self.robot)
        if not phi.any():
            return ()
        return self.predictions(IdentifiedModel(phi, *urdf_friction(self.robot)))

    def errors(self, predictions: Sequence[Prediction]) -> Errors:
        """Errors of predictions for all runs."""
        return errors_on(self.robot, self.runs, predictions)

    def traces(
        self, before: Sequence[Prediction], after: Sequence[Prediction], held_out: bool
    ) -> tuple[TorqueTrace, ...]:
        """Torque over time, measured and by both predictions."""
        return tuple(
            torque_trace(run, new.load, new.torque, old.torque, held_out)
            for run, old, new in zip(self.runs, before, after, strict=True)
        )


def _predicted(shared: tuple[Robot, IdentifiedModel], run: PreparedRun, tell: Tell) -> Prediction:
    robot, fitted = shared
    return fitted.predicted(robot, run)


def both_models(traced: Traced, parameters: Array) -> tuple[IdentifiedModel, IdentifiedModel]:
    """The declared model fitted to the training data, and the one with `parameters`."""
    found = _fitted(traced, traced.chosen, parameters)
    return refitted(traced, ()) if traced.chosen else found, found


def refitted(traced: Traced, chosen: Sequence[int]) -> IdentifiedModel:
    """The model with these of the candidates, fitted to the training data."""
    return _fitted(traced, chosen, traced.fitted(chosen))


def _fitted(traced: Traced, chosen: Sequence[int], parameters: Array) -> IdentifiedModel:
    model = traced.model
    effects = (*model.declared, *(traced.candidates[i].effect for i in chosen))
    values = parameters[len(parameters) - width_of(effects) :]
    return IdentifiedModel(model.full_inertias(parameters), effects, values)
