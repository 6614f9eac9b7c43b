"""Plausible sizes for the effects that the configuration declares: the robot has them too."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.covariate_series import CovariateSeries
from excite_cli.simulation.planted import Planted

_SHARE = (0.03, 0.10)  # of the joint's torque RMS, per parameter
_SAMPLES, _STATES = 200, 7  # random states, and their seed
_LEAST = 1e-3  # of the largest joint's torque RMS


def sized(
    robot: Robot,
    effects: Sequence[Effect],
    seed: int,
    covariates: Sequence[CovariateSeries] = (),
) -> tuple[Planted, ...]:
    """Each effect with values that give 3–10 % of the joint's torque RMS on brisk random states.

    They depend on the robot and the seed alone: the same robot plays every motion.

    Kinds that act on the whole robot, and defects of the data, take a twentieth of the upper end
    of their usual range. `covariates` are the columns of the log that effects follow.
    """
    if not effects:
        return ()
    rng = np.random.default_rng([seed, 1])
    followed = {
        each.name: np.interp(np.linspace(0, 1, _SAMPLES), np.linspace(0, 1, len(each.values)),
                             each.values)
        for each in covariates
    }  # fmt: skip
    signals = replace(_signals(robot), covariates=followed)
    load = np.sqrt(np.mean(signals.load**2, axis=0))
    load = np.maximum(load, _LEAST * load.max() + 1e-9)
    planted = []
    for effect in effects:
        share = rng.uniform(*_SHARE, len(effect.parameters))
        sign = np.where(
            [p.nonnegative for p in effect.parameters],
            1.0,
            rng.choice([-1.0, 1.0], len(effect.parameters)),
        )
        if effect.data_defect or effect.scope == "robot":
            shape, values = type(effect).planted(effect.parameters[0].high / 20, effect.shape)
            effect = replace(effect, shape=shape)
        else:
            unit = _per_unit(effect, signals)
            size = share * load[list(effect.joints)].min() / np.maximum(unit, 1e-6)
            values = sign * np.minimum(size, [p.high for p in effect.parameters])
        planted.append(Planted(effect, values, declared=True))
    return tuple(planted)


def _per_unit(effect: Effect, signals: Signals) -> Array:
    """RMS of each column over all rows the effect touches (P,)."""
    return np.asarray(np.sqrt(np.mean(effect.columns(signals) ** 2, axis=(0, 1))))


def _signals(robot: Robot) -> Signals:
    q, v, a = robot.draw_states(_SAMPLES, _STATES)
    v, a = 0.5 * v, 0.3 * a
    t = np.linspace(0.0, 1.0, _SAMPLES)
    body = RigidBody(robot, standard_parameters(robot), q, v, a)
    return Signals(t, q, v, a, body.load, body.load, body)
