"""Where a model can be trusted: the standard deviation of the torque that it predicts for a state.

What a model left of its own data says it where these data are; outside of them it leaves more. Of
joint j at speed v and rigid-body torque `load`,

    s² = ½ (r² + c₀ + c₁ v² + c₂ load² + c₃ exp(−(v/w)²)) h g² + (1.5 d)²,
    g = max(1, |v| / v₉₉, |load| / load₉₉),    d² = xᵀ C x,

with r² the mean square of the residuals, c ≥ 0 by least squares of their squares (as of a collision
detector, `thresholds`; half of each, since what a model lacks shows elsewhere on another motion), w
a tenth of the joint's RMS speed, h how many times more is left of held-out data than that says of
them, and v₉₉, load₉₉ what 99 % of the own data are below. d is the standard deviation of the torque
by the covariance C of the parameters, x their columns; more of it, since a model that lacks effects
is less sure of its parameters than its noise says.

The residual holds noise and effects that the model lacks, so that s is of a torque as it will be
measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import ConfigError
from excite_cli.identification.errors_of_torque import FEWEST
from excite_cli.identification.regression import (
    Series,
    effect_columns,
    signals_of,
    with_effects,
)
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.identification.uncertain_model import from_information
from excite_cli.robot.model import Array
from excite_cli.scoring.thresholds import speed_and_load_squares, squares_of

_REVERSAL = 0.1  # of a joint's RMS speed: below it friction is known least
_RANGE = 0.99  # quantile of the own data: beyond it a state is outside
# Of 14 simulated robots as they are, four motions each that took no part: without d and r² 1.96 s
# hold 87 to 93 % of the samples (means over the robots, by kind of motion), with d and no r² 90 to
# 94, with 2 d 93 to 96, so 92 to 96; RMS errors are within a factor of 1.5 of the predicted ones in
# 50, 50, 49, 51 of 56 motions.
_OF_PARAMETERS = 1.5
_MEAN = 0.5  # share of the mean square
_AT_ONCE = 2000  # states whose columns are in memory


@dataclass(frozen=True)
class Validity:
    """What a model leaves, by joint (n,): `coefficients` (n, 4), `width` w, `held_out` h.

    Half of r² is in the first coefficient. `speed` v₉₉ and `load` load₉₉; `lower` and `upper`
    positions. NaN of joints without enough samples.
    """

    coefficients: Array
    width: Array
    held_out: Array
    speed: Array
    load: Array
    lower: Array
    upper: Array

    def beyond(self, v: Array, load: Array) -> tuple[Array, Array]:
        """|v| / v₉₉ and |load| / load₉₉ (T, n): above 1 a state is outside of the own data."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.abs(v) / self.speed, np.abs(load) / self.load

    def away(self, q: Array) -> Array:
        """How far positions (T, n) are from the middle of the own ones, which end at 1."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.abs(q - middle) / half

    def deviation(self, v: Array, load: Array, d: Array) -> Array:
        """s (T, n) [N·m] (N)."""
        squares = squares_of(self.coefficients, v, load, self.width) * self.held_out
        farther = np.fmax(1.0, np.fmax(*self.beyond(v, load)))
        return np.asarray(np.sqrt(squares * farther**2 + np.square(_OF_PARAMETERS * d)))


def validity_of(traces: Sequence[TorqueTrace]) -> Validity:
    """From the traces of a model's own data."""
    n = traces[0].v.shape[1]
    q, v, load = (np.concatenate([getattr(t, name) for t in traces]) for name in ("q", "v", "load"))
    left = np.concatenate([np.where(t.counted, t.measured - t.predicted, np.nan) for t in traces])
    apart = np.concatenate([np.full(len(t.t), t.held_out) for t in traces])
    numbers = [_of_joint(v[:, j], load[:, j], left[:, j], apart) for j in range(n)]
    coefficients, width, more, fastest, heaviest = map(np.array, zip(*numbers, strict=True))
    ends = q.min(axis=0), q.max(axis=0)
    return Validity(coefficients, width, more, fastest, heaviest, *ends)


def _of_joint(
    v: Array, load: Array, left: Array, apart: NDArray[np.bool_]
) -> tuple[Array, float, float, float, float]:
    known = np.isfinite(left)
    if known.sum() < FEWEST:
        return np.full(4, nan), nan, nan, nan, nan
    v, load, left = (x[known] for x in (v, load, left))
    apart = apart[known]
    width = _REVERSAL * float(np.sqrt(np.mean(np.square(v))))
    squares = np.square(left)
    coefficients = (1.0 - _MEAN) * speed_and_load_squares(squares, v, load, width)
    coefficients[0] += _MEAN * squares.mean()
    more = 1.0
    if min(apart.sum(), (~apart).sum()) >= FEWEST:
        own = squares_of(coefficients[None], v[apart, None], load[apart, None], np.array([width]))
        more = max(1.0, float(squares[apart].mean() / own.mean()))
    fastest, heaviest = (float(np.quantile(np.abs(x), _RANGE)) for x in (v, load))
    return coefficients, width, more, fastest, heaviest


class Trust:
    """What is known of the torque that a stored model predicts, for any states."""

    def __init__(self, stored: StoredModel) -> None:
        """ConfigError where the model keeps no residual of its own data."""
        if not stored.traces:
            raise ConfigError(
                f"{stored.path} does not say what it left of its own data. Give the fit (excite "
                "identify -o) or the diagnosis (excite diagnose -o) itself."
            )
        self._robot, self._model = stored.robot, stored.model
        self._root = _root_of(stored)
        self.validity = validity_of(stored.traces)

    def deviation(self, series: Series, load: Array) -> Array:
        """s (T, n) [N·m] (N) of the torque, beside the model's `load` (T, n)."""
        return self.validity.deviation(series.v, load, self.by_parameters(series))

    def by_parameters(self, series: Series) -> Array:
        """d (T, n) [N·m] (N): of the torque by the covariance of the parameters; 0 if unknown."""
        if self._root is None:
            return np.zeros_like(series.q)
        robot, model = self._robot, self._model
        signals = signals_of(series, robot, model.phi)
        signals = with_effects(signals, model.effects, model.values)
        effects = effect_columns(model.effects, signals)
        found = np.empty_like(series.q)
        for start in range(0, len(found), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            body = RigidBody(robot, model.phi, series.q[part], series.v[part], series.a[part])
            columns = np.concatenate([body.regressor, effects[part]], axis=2)
            found[part] = np.sqrt(np.square(columns @ self._root).sum(axis=2))
        return found


def _root_of(stored: StoredModel) -> Array | None:
    """B (P + k, m) of the covariance B Bᵀ; None where it is not known."""
    if stored.factor is None:
        return None
    base, cad = find_base_parameters(stored.robot), standard_parameters(stored.robot)
    return from_information(base, inertial_prior(stored.robot, cad, UNSURE), stored.factor)
