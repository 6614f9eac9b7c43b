"""Where a model can be trusted: the standard deviation of the torque that it predicts for a state.

What a model left of its own data says it where these data are; outside of them it leaves more. Of
joint j at speed v and rigid-body torque `load`,

    s² = (r²/5 + ⅘ (c₀ + c₁ v² + c₂ load² + c₃ exp(−(v/w)²))) g² + d²,
    g = max(1, |v| / v₉₉, |load| / load₉₉),    d² = xᵀ C x,

with r² the mean square of the residuals, c ≥ 0 by least squares of their squares (as of a collision
detector, `thresholds`; a fifth of them is taken as everywhere, since what a model lacks shows
elsewhere on another motion), w a twentieth of the joint's RMS speed, and v₉₉, load₉₉ what 99 % of
the own data are below. d is the standard deviation of the torque by the covariance C of the
parameters, x their columns.

The residual holds noise and effects that the model lacks, so that s is of a torque as it will be
measured, also where a joint stands or reverses and its friction is anything.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import ConfigError
from excite_cli.identification.errors_of_torque import FEWEST
from excite_cli.identification.factors import triangle_of
from excite_cli.identification.regression import (
    Series,
    effect_columns,
    signals_of,
    with_effects,
)
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.identification.uncertain_model import from_information
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array
from excite_cli.scoring.thresholds import speed_and_load_squares, squares_of

_REVERSAL = 0.05  # of a joint's RMS speed: below it friction is known least
_STANDS = 1e-9  # rad/s: no joint that moves is slower
_RANGE = 0.99  # quantile of the own data: beyond it a state is outside
# Share of the mean square. Of 14 simulated robots as they are, four motions each that took no part:
# with none 1.96 s hold 87 to 89 % of the samples (means over the robots, by kind of motion), with
# this 95 to 97, and RMS errors are within a factor of 1.5 of the predicted ones in 47 of 56.
_MEAN = 0.2
_AT_ONCE = 2000  # states whose columns are in memory


@dataclass(frozen=True)
class Validity:
    """What a model leaves, by joint (n,): `coefficients` (n, 4) and `width` w.

    The share of r² is in the first coefficient. `speed` v₉₉ and `load` load₉₉; `lower` and `upper`
    positions. NaN of joints without enough samples.
    """

    coefficients: Array
    width: Array
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
        squares = squares_of(self.coefficients, v, load, self.width)
        farther = np.fmax(1.0, np.fmax(*self.beyond(v, load)))
        return np.asarray(np.sqrt(squares * farther**2 + d**2))


def validity_of(traces: Sequence[TorqueTrace]) -> Validity:
    """From the traces of a model's own data."""
    n = traces[0].v.shape[1]
    q, v, load = (np.concatenate([getattr(t, name) for t in traces]) for name in ("q", "v", "load"))
    left = np.concatenate([t.measured - t.predicted for t in traces])
    numbers = [_of_joint(v[:, j], load[:, j], left[:, j]) for j in range(n)]
    coefficients, width, fastest, heaviest = map(np.array, zip(*numbers, strict=True))
    return Validity(coefficients, width, fastest, heaviest, q.min(axis=0), q.max(axis=0))


def _of_joint(v: Array, load: Array, left: Array) -> tuple[Array, float, float, float]:
    known = np.isfinite(left)
    if known.sum() < FEWEST:
        return np.full(4, nan), nan, nan, nan
    v, load, squares = v[known], load[known], np.square(left[known])
    width = max(_REVERSAL * float(np.sqrt(np.mean(np.square(v)))), _STANDS)
    coefficients = (1.0 - _MEAN) * speed_and_load_squares(squares, v, load, width)
    coefficients[0] += _MEAN * squares.mean()
    fastest, heaviest = (float(np.quantile(np.abs(x), _RANGE)) for x in (v, load))
    return coefficients, width, fastest, heaviest


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
        self.validity = validity_of(stored.traces)
        # B (P + k, m) of the covariance B Bᵀ of φ and the effects; None where it is not known.
        self.root = self._root_of(stored)

    def deviation(self, series: Series, load: Array) -> Array:
        """s (T, n) [N·m] (N) of the torque, beside the model's `load` (T, n)."""
        return self.validity.deviation(series.v, load, self.by_parameters(series))

    def by_parameters(self, series: Series) -> Array:
        """d (T, n) [N·m] (N): of the torque by the covariance of the parameters; 0 if unknown."""
        if self.root is None:
            return np.zeros_like(series.q)
        robot, model = self._robot, self._model
        effects = self._effects(series)
        found = np.empty_like(series.q)
        for start in range(0, len(found), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            body = RigidBody(robot, model.phi, series.q[part], series.v[part], series.a[part])
            columns = np.concatenate([body.regressor, effects[part]], axis=2)
            found[part] = np.sqrt(np.square(columns @ self.root).sum(axis=2))
        return found

    def _effects(self, series: Series) -> Array:
        """Columns (T, n, k) of the effects."""
        signals = signals_of(series, self._robot, self._model.phi)
        signals = with_effects(signals, self._model.effects, self._model.values)
        return effect_columns(self._model.effects, signals)

    def _root_of(self, stored: StoredModel) -> Array | None:
        """B (P + k, m) of the covariance B Bᵀ; None where it is not known.

        Nor where effects follow a column of the log, which traces do not keep.
        """
        if stored.factor is None or any(effect.covariate for effect in stored.model.effects):
            return None
        base, cad = find_base_parameters(stored.robot), standard_parameters(stored.robot)
        rows = np.pad(np.diag(self._usual(stored.traces)), ((0, 0), (base.rank, 0)))
        factor = triangle_of(np.vstack([stored.factor, rows]))
        return from_information(base, inertial_prior(stored.robot, cad, UNSURE), factor)

    def _usual(self, traces: Sequence[TorqueTrace]) -> Array:
        """1 (k,) over the sizes of effects that make all torque of a joint in the own data.

        None is more. Where dry friction of a joint and of the gears that it shares with another
        were one number of two, 1.7 kN·m were said of a torque of 2 N·m.
        """
        columns, torque = 0.0, 0.0
        for each in traces:
            series = Series(each.t, each.q, each.v, each.a, RunId(each.run))
            columns = columns + np.square(self._effects(series)).sum(axis=0)
            torque = torque + np.square(np.nan_to_num(each.measured)).sum(axis=0)
        share = np.asarray(columns) / np.maximum(np.asarray(torque), 1e-300)[:, None]
        return np.asarray(np.sqrt(share.max(axis=0, initial=0.0)))
