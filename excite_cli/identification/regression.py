"""The regression: torque and the columns that explain it, filtered and decimated alike."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class RunColumns:
    """One prepared run with its columns.

    `inertial` (M, n, P) standard-parameter regressor (P = 10·n_bodies), `effects` (M, n, k) all
    linear parameters of all effects in order, `tau` (M, n), `usable` and `moving` (M, n), `step`
    between the samples [s]; `prepared` holds the motion at the working rate.
    """

    step: float
    inertial: Array
    effects: Array
    tau: Array
    usable: NDArray[np.bool_]
    moving: NDArray[np.bool_]
    prepared: PreparedRun


@dataclass(frozen=True)
class Regression:
    """τ = Y φ + effects, run by run."""

    robot: Robot
    base: BaseParameters
    effects: tuple[Effect, ...]
    runs: tuple[RunColumns, ...]


def signals_of(prepared: PreparedRun, robot: Robot, phi: Array | None = None) -> Signals:
    """What effects may look at in a run, with the rigid-body torque at `phi` (default: URDF)."""
    phi = standard_parameters(robot) if phi is None else phi
    body = RigidBody(robot, phi, prepared.q, prepared.v, prepared.a)
    return Signals(
        prepared.t, prepared.q, prepared.v, prepared.a, body.load, body.load, body,
        prepared.run, prepared.start,
    )  # fmt: skip


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


def carrying(signals: Signals, effects: Sequence[Effect], values: Array) -> Signals:
    """The signals with the bodies that `effects` of `values` add: their torque is load, too."""
    if not any(effect.rigid_body for effect in effects):
        return signals
    load = signals.load + _torque_of(signals, effects, values, [e.rigid_body for e in effects])
    return replace(signals, load=load, torque=load)


def with_torque(signals: Signals, effects: Sequence[Effect], values: Array) -> Signals:
    """The signals with the torque of `effects` of `values` beside the load.

    Defects of the measurement do not change the torque that they act upon.
    """
    seen = [not (effect.rigid_body or effect.data_defect) for effect in effects]
    return replace(signals, torque=signals.load + _torque_of(signals, effects, values, seen))


def _torque_of(
    signals: Signals, effects: Sequence[Effect], values: Array, which: Sequence[bool]
) -> Array:
    """Torque (T, n) of those effects `which` are meant."""
    meant = np.repeat(which, [len(effect.parameters) for effect in effects])
    return effect_columns(effects, signals) @ np.where(meant, values, 0.0)


def build_regression(
    robot: Robot,
    base: BaseParameters,
    effects: Sequence[Effect],
    runs: Sequence[PreparedRun],
    phi: Array | None = None,
) -> Regression:
    """Columns of every run; effects that look at the torque see the rigid body at `phi`."""
    found = []
    for prepared in runs:
        signals = signals_of(prepared, robot, phi)
        found.append(
            RunColumns(
                step=prepared.step,
                inertial=prepared.averaged_for_fit(signals.body.regressor),
                effects=prepared.averaged_for_fit(effect_columns(effects, signals)),
                tau=prepared.tau_fit,
                usable=prepared.usable,
                moving=prepared.moving,
                prepared=prepared,
            )
        )
    return Regression(robot, base, tuple(effects), tuple(found))
