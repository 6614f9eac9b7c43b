"""A run as the model sees it: rigid-body quantities, signals for effects, training columns."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from excite_cli.diagnosis.training import TrainingData
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import InertialPrior, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.declared_states import States
from excite_cli.identification.prepare import PreparedRun
from excite_cli.identification.regression import (
    effect_columns,
    for_base_columns,
    seen_of,
    width_of,
    with_effects,
)
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array, Robot
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# What a diagnosis knows before: robot, declared effects, a prior or none, what was weighed.


@dataclass(frozen=True)
class DeclaredModel:
    """What is known before: robot, declared effects, a prior on the inertias, states of runs.

    `vague`: the prior is no word of the user's, who left the inertias to the data.
    `weighed` (m, r + k + 1): rows [W target] in standard deviations, over the base parameters and
    the parameters of the declared effects.
    """

    robot: Robot
    base: BaseParameters
    declared: tuple[Effect, ...]
    prior: InertialPrior | None
    states: States = field(default_factory=dict)
    weighed: Array | None = None
    vague: bool = False

    @property
    def declared_width(self) -> int:
        """Number of linear parameters of the declared effects."""
        return width_of(self.declared)

    @property
    def is_weighed(self) -> bool:
        """Whether scales say something of the parameters."""
        return self.weighed is not None and bool(self.weighed.any())

    @property
    def scales(self) -> Array:
        """`weighed`, or no rows."""
        width = self.base.rank + self.declared_width + 1
        return np.zeros((0, width)) if self.weighed is None else self.weighed

    @property
    def known(self) -> Array:
        """Rows as `weighed` of all that is known without data: the scales' and the prior's."""
        if self.prior is None:
            return self.scales
        return np.concatenate([self.scales, self.prior.rows(self.base, self.declared_width)])

    @property
    def by_urdf(self) -> Array:
        """φ_B (r,) of the URDF."""
        return np.asarray(self.base.mapping @ standard_parameters(self.robot))

    def full_inertias(self, parameters: Array) -> Array:
        """Full φ (P,) nearest to the URDF's that agrees with the fitted inertial parameters."""
        nearest = inertial_prior(self.robot, standard_parameters(self.robot), 1.0)
        return nearest.completed(self.base, parameters[: self.base.rank])


class ModelledRun:
    """A run's rigid-body quantities; `inertial` (M, n, r): averages of base parameters' columns."""

    def __init__(self, model: DeclaredModel, run: PreparedRun, inertial: Array) -> None:
        self.model = model
        self._body = RigidBody(model.robot, standard_parameters(model.robot), run.q, run.v, run.a)
        self.take(run, inertial)

    def take(self, run: PreparedRun, inertial: Array) -> None:
        """The same motion with other averages, and the columns with these."""
        self.run, self.inertial = run, inertial

    def signals(self, phi: Array, effects: Sequence[Effect], values: Array) -> Signals:
        """What effects see of the run at inertias φ, with the torque of `effects` of `values`."""
        return with_effects(seen_of(self.run, self.body(phi)), effects, values)

    def body(self, phi: Array) -> RigidBody:
        """The rigid body at φ; the last one is kept, with all that was computed of it."""
        if not np.array_equal(phi, self._body.phi):
            run = self.run
            self._body = RigidBody(self.model.robot, phi, run.q, run.v, run.a)
        return self._body


def signals_of_all(
    modelled: Sequence[ModelledRun], phi: Array, effects: Sequence[Effect], values: Array
) -> list[Signals]:
    """As `ModelledRun.signals` of every run."""
    lacking = [own for own in modelled if "load" not in own.body(phi).__dict__]
    if lacking:
        spool = Spool()
        loads = each(_load, (lacking[0].model.robot, phi), (own.run for own in lacking))
        for own, load in zip(lacking, loads, strict=True):
            own.body(phi).load = spool.keep(load)
    return [own.signals(phi, effects, values) for own in modelled]


def _load(shared: tuple[Robot, Array], run: PreparedRun, tell: Tell) -> Array:
    robot, phi = shared
    return RigidBody(robot, phi, run.q, run.v, run.a).load


def inertial_columns(model: DeclaredModel, runs: Sequence[PreparedRun]) -> list[Array]:
    """Averages (M, n, r) of the base parameters' columns of every run."""
    spool = Spool()
    return [spool.keep(columns) for columns in each(_inertial, model, runs)]


def _inertial(model: DeclaredModel, run: PreparedRun, tell: Tell) -> Array:
    phi = standard_parameters(model.robot)
    columns = RigidBody(model.robot, phi, run.q, run.v, run.a).regressor
    return run.averaged_for_fit(columns[:, :, model.base.selection])


def training_data(
    model: DeclaredModel,
    folds: Sequence[int],
    modelled: Sequence[ModelledRun],
    signals: Sequence[Signals],
) -> TrainingData:
    """Columns of the declared model and torque of every part; `folds` are left out together."""
    spool = Spool()
    tasks = ((body.run, body.inertial, s) for body, s in zip(modelled, signals, strict=True))
    parts = [
        (spool.keep(columns), spool.keep(tau)) for columns, tau in each(_declared, model, tasks)
    ]
    runs = tuple(body.run for body in modelled)
    declared, torques = zip(*parts, strict=True)
    prior, weighed = (rows.T @ rows for rows in (model.known, model.scales))
    return TrainingData(runs, tuple(folds), declared, torques, prior, weighed)


def _declared(
    model: DeclaredModel, task: tuple[PreparedRun, Array, Signals], tell: Tell
) -> tuple[Array, Array]:
    """Inertial columns and those of the declared effects, and torque."""
    run, inertial, signals = task
    own = run.averaged_for_fit(effect_columns(model.declared, signals))
    return np.concatenate([inertial, own], axis=2), for_base_columns(model.robot, model.base, run)
