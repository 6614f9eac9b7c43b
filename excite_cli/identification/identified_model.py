"""A model with all its numbers: inertias, effects, their values. What it predicts, and slopes.

    τ = L + R + D,    L = Y (φ + bodies carried) ,    R = R(q, v, a, L),    D = D(…, L + R)

R are the effects of the robot, which may look at the load L (gears carry bodies among the effects,
too), D the defects of the measurement, which look at the robot's whole torque.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import urdf_friction
from excite_cli.identification.errors_of_torque import Errors, torque_errors
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import (
    Series,
    carried_by,
    places_of,
    signals_of,
    torque_of,
    with_effects,
)
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class Prediction:
    """Of one run, (T, n) at the working rate: rigid-body torque, and all of it with the effects."""

    load: Array
    torque: Array


@dataclass(frozen=True)
class IdentifiedModel:
    """Inertias φ (10·n_bodies,), effects, and `values` (k,) of all their linear parameters."""

    phi: Array
    effects: tuple[Effect, ...] = ()
    values: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def by_effect(self) -> Iterator[tuple[Effect, Array]]:
        """Every effect with its linear parameters."""
        places = places_of(self.effects, len(self.values))
        return ((effect, self.values[at]) for effect, at in zip(self.effects, places, strict=True))

    def without(self, left: tuple[Effect, ...]) -> "IdentifiedModel":
        """The same without these effects."""
        kept = [(effect, values) for effect, values in self.by_effect if effect not in left]
        values = np.concatenate([np.zeros(0), *(each for _, each in kept)])
        return replace(self, effects=tuple(effect for effect, _ in kept), values=values)

    @property
    def of_single_runs(self) -> tuple[Effect, ...]:
        """Effects that some recordings had: no part of the robot as such."""
        return tuple(effect for effect in self.effects if effect.runs)

    def predicted(self, robot: Robot, run: PreparedRun | Series) -> Prediction:
        """What it says of the motion of a prepared run, or of a series of states."""
        alone = signals_of(run, robot, self.phi)
        signals = with_effects(alone, self.effects, self.values)
        defects = torque_of(self.effects, self.values, signals, lambda effect: effect.data_defect)
        return Prediction(alone.load, signals.torque + defects)

    def pull_back(self, robot: Robot, series: Series, weights: Array) -> tuple[Array, Array, Array]:
        """Derivatives by q, v, a, each (T, n), of Σ weights ∘ τ; weights (T, n).

        Raises
        ------
        NotImplementedError
            An effect has no derivatives (`excitable` says so).
        """
        signals = with_effects(signals_of(series, robot, self.phi), self.effects, self.values)
        carried = self.carried(robot, series.run)
        total = np.zeros((3, *weights.shape))
        onward = weights.copy()  # what reaches the torque, then the load
        for defects in (True, False):
            found = np.zeros_like(weights)
            for effect, values in self.by_effect:
                if effect.carried or effect.data_defect != defects or not effect.active(series.run):
                    continue
                rows = onward[:, list(effect.rows(robot.n))]
                effect.pull_back(signals, rows[:, :, None] * values).add_to(total, found)
            onward = onward + found
        body = RigidBody(robot, self.phi + carried, series.q, series.v, series.a)
        total += np.array(body.pull_back(onward))
        return total[0], total[1], total[2]

    def carried(self, robot: Robot, run: RunId | None = None) -> Array:
        """φ (10·n_bodies,) of the bodies among the effects."""
        return carried_by(self.effects, self.values, robot, run or RunId())


def errors_on(
    robot: Robot, runs: Sequence[PreparedRun], predictions: Sequence[Prediction]
) -> Errors:
    """Errors of the predictions for `runs`."""
    return torque_errors(robot.joint_names, runs, [each.torque for each in predictions])


def as_described(robot: Robot) -> IdentifiedModel | None:
    """The robot as its URDF has it, with the friction of its <dynamics>; None without masses."""
    phi = standard_parameters(robot)
    return IdentifiedModel(phi, *urdf_friction(robot)) if phi.any() else None
