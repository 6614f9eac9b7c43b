"""The regression: torque and the columns that explain it, filtered and decimated alike."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.covariance import RunRows
from excite_cli.identification.declared_states import LeftOut
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import RunId
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array, Robot
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

# Samples on which columns are tried: whether they change with the model's torque.
_PROBE = 60


@dataclass(frozen=True)
class RunColumns:
    """One prepared run with its columns.

    `columns` (M, n, r + k): the regressor of the `rank` base parameters, then all linear parameters
    of all effects in order; `tau` (M, n); `prepared` holds the motion at the working rate.
    """

    columns: Array
    rank: int
    tau: Array
    prepared: PreparedRun

    @property
    def inertial(self) -> Array:
        """Columns (M, n, r) of the base parameters."""
        return self.columns[:, :, : self.rank]

    @property
    def effects(self) -> Array:
        """Columns (M, n, k) of the effects."""
        return self.columns[:, :, self.rank :]

    @property
    def rows(self) -> RunRows:
        """Rows for the least-squares fit."""
        own = self.prepared
        return RunRows(self.columns, self.tau, own.usable, rounding=own.rounding, unsure=own.unsure)


@dataclass(frozen=True)
class Regression:
    """τ = Y φ + effects, run by run."""

    robot: Robot
    base: BaseParameters
    effects: tuple[Effect, ...]
    runs: tuple[RunColumns, ...]


@dataclass(frozen=True)
class Series:
    """States (T, n) at equidistant instants `t` (T,) [s], and what else effects look at.

    `start` [s] on the campaign's clock; `covariates` (T,) by name; `before` (L, n) positions of the
    same time step before the first, where they are known.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    run: RunId = field(default_factory=RunId)
    start: float = 0.0
    covariates: Mapping[str, Array] = field(default_factory=dict)
    before: Array | None = None


def signals_of(motion: PreparedRun | Series, robot: Robot, phi: Array | None = None) -> Signals:
    """What effects may look at in a motion, with the rigid-body torque at `phi` (default: URDF)."""
    phi = standard_parameters(robot) if phi is None else phi
    return seen_of(motion, RigidBody(robot, phi, motion.q, motion.v, motion.a))


def seen_of(motion: PreparedRun | Series, body: RigidBody) -> Signals:
    """What effects may look at in a motion whose rigid body is known, moving as it does."""
    return Signals(
        motion.t, motion.q, motion.v, motion.a, body.load, body.load, body,
        motion.run, motion.start, motion.covariates, motion.before,
    )  # fmt: skip


def with_effects(signals: Signals, effects: Sequence[Effect], values: Array) -> Signals:
    """The same, with the torque of `effects` of `values` in it.

    Bodies among them are part of the rigid body: gears carry them, and gravity from elsewhere draws
    on them, too. Defects of the measurement are left out: they do not change the torque that they
    act upon.
    """
    if not len(values):
        return signals
    body = signals.body
    carried = carried_by(effects, values, body.robot, signals.run)
    if carried.any():
        laden = RigidBody(body.robot, body.phi + carried, signals.q, signals.v, signals.a)
        signals = replace(signals, load=laden.load, torque=laden.load, laden=laden)
    rest = torque_of(effects, values, signals, lambda e: not (e.carried or e.data_defect))
    return replace(signals, torque=signals.load + rest)


def carried_by(effects: Sequence[Effect], values: Array, robot: Robot, run: RunId) -> Array:
    """φ (10·n_bodies,) of the bodies among effects that are present in a run."""
    phi = np.zeros(PARAMETERS_PER_BODY * robot.n_bodies)
    for effect, at in zip(effects, places_of(effects, len(values)), strict=True):
        if effect.carried and effect.active(run):
            first = PARAMETERS_PER_BODY * (robot.model_joints[effect.joints[-1]] - 1)
            phi[first : first + PARAMETERS_PER_BODY] += values[at]
    return phi


def torque_of(
    effects: Sequence[Effect], values: Array, signals: Signals, among: Callable[[Effect], bool]
) -> Array:
    """Torque (T, n) [N·m] of some of the effects, whose linear parameters are `values` (k,)."""
    n = signals.q.shape[1]
    total = np.zeros((len(signals.t), n))
    for effect, at in zip(effects, places_of(effects, len(values)), strict=True):
        if among(effect) and effect.active(signals.run):
            total[:, list(effect.rows(n))] += effect.columns(signals) @ values[at]
    return total


def width_of(effects: Sequence[Effect]) -> int:
    """Number of linear parameters of effects."""
    return sum(len(effect.parameters) for effect in effects)


def places_of(effects: Sequence[Effect], count: int) -> list[slice]:
    """Where the linear parameters of each effect are: together they are the last of `count`."""
    edges = np.cumsum([count - width_of(effects), *(len(each.parameters) for each in effects)])
    return [slice(start, end) for start, end in pairwise(edges.tolist())]


def effect_columns(effects: Sequence[Effect], signals: Signals) -> Array:
    """Columns (T, n, k) of all linear parameters of all effects, at the working rate."""
    n = signals.q.shape[1]
    blocks = [np.zeros((len(signals.t), n, 0))]
    for effect in effects:
        block = np.zeros((len(signals.t), n, len(effect.parameters)))
        if effect.active(signals.run):
            block[:, list(effect.rows(n))] = effect.columns(signals)
        blocks.append(block)
    return np.concatenate(blocks, axis=2)


def for_base_columns(robot: Robot, base: BaseParameters, run: PreparedRun) -> Array:
    """Torque (M, n) to be fitted by the columns of the base parameters.

    Where the base moves, without what these leave out: how it sways shows too little of its inertia
    to be fitted, so that the URDF's is taken.
    """
    if not robot.base_joints:
        return run.tau_fit
    rest = RigidBody(robot, base.beside(standard_parameters(robot)), run.q, run.v, run.a)
    return run.tau_fit - run.averaged_for_fit(rest.load)


def build_regression(
    robot: Robot,
    base: BaseParameters,
    effects: Sequence[Effect],
    runs: Sequence[PreparedRun],
    phi: Array | None = None,
    values: Array = np.zeros(0),
) -> Regression:
    """Columns of every run; effects that look at the torque see the rigid body at `phi`.

    With `values` of the effects, they see the torque of these as well.
    """
    found, spool = [], Spool()
    shared = robot, base.selection, effects, phi, values
    columns = each(_columns, shared, [(prepared, None) for prepared in runs])
    for prepared, own in zip(runs, columns, strict=True):
        tau = for_base_columns(robot, base, prepared)
        found.append(RunColumns(spool.keep(own), base.rank, tau, prepared))
    return Regression(robot, base, tuple(effects), tuple(found))


def regression_on(
    robot: Robot,
    base: BaseParameters,
    effects: Sequence[Effect],
    runs: Sequence[Run],
    processing: Processing,
) -> Regression:
    """The regression of recorded runs, without what `effects` leave out.

    Raises
    ------
    FileError
        A run is too short.
    """
    prepared = prepare_all(runs, processing, LeftOut.by(effects))
    return build_regression(robot, base, effects, prepared)


def _columns(
    shared: tuple[Robot, NDArray[np.intp], Sequence[Effect], Array | None, Array],
    task: tuple[PreparedRun, Array | None],
    tell: Tell,
) -> Array:
    """Averages of the regressor of the base parameters (if not given), and of effects' columns."""
    (robot, selection, effects, phi, values), (prepared, inertial) = shared, task
    signals = with_effects(signals_of(prepared, robot, phi), effects, values)
    if inertial is None:
        inertial = prepared.averaged_for_fit(signals.body.regressor[:, :, selection])
        signals.forget()
    own = prepared.averaged_for_fit(effect_columns(effects, signals))
    return np.concatenate([inertial, own], axis=2)


def follows_model(regression: Regression) -> bool:
    """Whether columns of the effects change with φ, tried on a few samples."""
    if not regression.effects or not regression.runs:
        return False
    whole, cut = regression.runs[0].prepared, slice(0, _PROBE)
    covariates = {name: values[cut] for name, values in whole.covariates.items()}
    states = whole.t[cut], whole.q[cut], whole.v[cut], whole.a[cut]
    brief = Series(*states, whole.run, whole.start, covariates, whole.before)
    cad = standard_parameters(regression.robot)
    one, other = (
        effect_columns(regression.effects, signals_of(brief, regression.robot, phi))
        for phi in (cad, 1.3 * cad)
    )
    return not np.allclose(one, other, rtol=1e-9, atol=1e-12)


def rebuilt(regression: Regression, phi: Array, values: Array) -> Regression:
    """The effects' columns again, with the rigid body at `phi` and effects of `values`."""
    selection = regression.base.selection
    spool, shared = Spool(), (regression.robot, selection, regression.effects, phi, values)
    made = each(_columns, shared, [(run.prepared, run.inertial) for run in regression.runs])
    runs = zip(regression.runs, made, strict=True)
    return replace(
        regression, runs=tuple(replace(run, columns=spool.keep(own)) for run, own in runs)
    )
