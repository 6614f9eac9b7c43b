"""Where a model can be trusted: the standard deviation of the torque that it predicts for a state.

What a model left of its own data says it where these data are; outside of them it leaves more. Of
joint j that moves with speed v, acceleration a and rigid-body torque `load`,

    s² = (r²/5 + ⅘ (c₀ + c₁ v² + c₂ load² + c₃ ρ²)) h g² + d² + D²/20,    ρ = 1 / (1 + (v/(a T))²),
    g = max(1, |v| / v₉₉, |load| / load₉₉),    d² = xᵀ C x,
    D = τ − load − (f_v v + f_c sgn v + i a + τ₀ + k q + κ load),

with r² the mean square of the residuals, c ≥ 0 by least squares of their squares (`thresholds`; a
fifth of them is taken as everywhere, since what a model lacks shows elsewhere on another motion).
v₉₉ and load₉₉ are what 99 % of the own data are below; no larger v² and load² count in the bracket.
h ≥ 1: how many times more a motion that took no part leaves, e²/s² on held-out data, mean over time
and median over joints, with s of the training data without d. A joint reverses v/a from now or
before: ρ is 1 if that is short beside T, by which filters smear a reversal. d is the standard
deviation of the torque by the covariance C of the parameters, x their columns. D is what the
effects add to the straight function that is nearest to them in the own data: what the form of a
curve says elsewhere is uncertain however well its size is known. Where the joint stands
(|v| ≤ v_m), friction is anything up to ±f_c, which has the variance f_c²/3: that stands for D²/20,
and the bracket is the mean square of the residuals at standstill if that is more.

The residual holds noise and effects that the model lacks, so that s is of a torque as it will be
measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan

import numpy as np

from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.pseudo_inertia import UNSURE, inertial_prior
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import ConfigError
from excite_cli.identification.errors_of_torque import FEWEST
from excite_cli.identification.factors import triangle_of
from excite_cli.identification.identified_model import Prediction
from excite_cli.identification.processing import DEFAULT_MOVING, GAUSSIAN, Processing
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
from excite_cli.scoring.thresholds import variance_coefficients

_RANGE = 0.99  # quantile of the own data: beyond it a state is outside
# Of 49 simulated robots as they are, four motions each that took no part (docs/decisions/
# where-a-model-is-valid.md). Share of the mean square, and of the squared difference from the line:
_MEAN = 0.2
CURVE = 0.05
_MOST = 9.0  # h: more is another fault than a fit's
_SHARP = 12.0  # Hz: cut-off of torques that no filter averages
_REVERSES = 0.5  # ρ that some sample must have, or the data show no reversal
_AT_ONCE = 2000  # states whose columns are in memory
_NAMES = ("q", "v", "a", "load", "predicted")  # of traces, for `States`


@dataclass(frozen=True)
class States:
    """What a model is asked for: `q`, `v`, `a`; its rigid-body `load` and `torque`; all (T, n)."""

    q: Array
    v: Array
    a: Array
    load: Array
    torque: Array


@dataclass(frozen=True)
class Validity:
    """What a model leaves, by joint (n,): `coefficients` (n, 4), `standing` mean square at rest.

    The share of r² is in the first coefficient. `line` (n, 6): f_v, f_c, i, τ₀, k, κ. `speed` v₉₉,
    `load` load₉₉; `lower` and `upper` positions. `moving` v_m, `smear` T [s]. NaN of joints without
    enough samples.
    """

    coefficients: Array
    standing: Array
    line: Array
    speed: Array
    load: Array
    lower: Array
    upper: Array
    moving: float
    smear: float

    def beyond(self, v: Array, load: Array) -> tuple[Array, Array]:
        """|v| / v₉₉ and |load| / load₉₉ (T, n): above 1 a state is outside of the own data."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.abs(v) / self.speed, np.abs(load) / self.load

    def away(self, q: Array) -> Array:
        """How far positions (T, n) are from the middle of the own ones, which end at 1."""
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.abs(q - middle) / half

    def moves(self, v: Array) -> Array:
        """Where joints move (T, n)."""
        return np.asarray(np.abs(v) > self.moving)

    def left(self, states: States) -> Array:
        """Variance (T, n) of what the model lacks, where joints move: the bracket times h g²."""
        v, load = states.v, states.load
        inside = np.clip(v, -self.speed, self.speed), np.clip(load, -self.load, self.load)
        columns = _columns(states, self.smear)
        columns[..., 1:3] = np.square(np.stack(inside, axis=-1))
        farther = np.square(np.fmax(1.0, np.fmax(*self.beyond(v, load))))
        return np.asarray(np.einsum("tjc,jc->tj", columns, self.coefficients) * farther)

    def deviation(self, states: States, d: Array | float = 0.0) -> Array:
        """s (T, n) [N·m] (N)."""
        v, load, left = states.v, states.load, self.left(states)
        curve = states.torque - load - np.einsum("tjc,jc->tj", _line(states), self.line)
        stands = np.maximum(left, self.standing) + np.square(self.line[:, 1]) / 3.0
        moves = left + CURVE * np.square(curve)
        return np.asarray(np.sqrt(np.where(self.moves(v), moves, stands) + d**2))


def _columns(states: States, smear: float) -> Array:
    """1, v², load², ρ² (T, n, 4)."""
    way = np.square(smear * states.a)
    reversal = way / np.maximum(way + states.v**2, 1e-300)
    one = np.ones_like(states.v)
    return np.stack([one, states.v**2, states.load**2, reversal**2], axis=-1)


def _line(states: States) -> Array:
    """v, sgn v, a, 1, q, load (T, n, 6)."""
    q, v, a = states.q, states.v, states.a
    return np.stack([v, np.sign(v), a, np.ones_like(v), q, states.load], axis=-1)


def validity_of(traces: Sequence[TorqueTrace], processing: Processing | None) -> Validity:
    """From the traces of a model's own data, which were filtered by `processing`."""
    found = _of_these(traces, processing)
    held = [trace for trace in traces if trace.held_out]
    if not held or len(held) == len(traces):
        return found
    training = _of_these([trace for trace in traces if not trace.held_out], processing)
    ratios = np.concatenate([_against(training, trace) for trace in held])
    count = np.isfinite(ratios).sum(axis=0)
    enough = count >= FEWEST
    mean = np.nansum(ratios, axis=0)[enough] / count[enough]
    h = float(np.clip(np.median(mean), 1.0, _MOST)) if len(mean) else 1.0
    return replace(found, coefficients=h * found.coefficients, standing=h * found.standing)


def _against(validity: Validity, trace: TorqueTrace) -> Array:
    """e²/s² (T, n) of a trace where joints move, else NaN."""
    s = validity.deviation(_states_in(trace))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.square((trace.measured - trace.predicted) / s)
    return np.where(validity.moves(trace.v), ratio, nan)


def _of_these(traces: Sequence[TorqueTrace], processing: Processing | None) -> Validity:
    smear = GAUSSIAN / ((processing and processing.parallel_cutoff) or _SHARP)
    moving = processing.moving_speed if processing else DEFAULT_MOVING
    own = States(*(np.concatenate([getattr(t, name) for t in traces]) for name in _NAMES))
    left = np.concatenate([t.measured for t in traces]) - own.torque
    columns, line, added = _columns(own, smear), _line(own), own.torque - own.load
    numbers = []
    for j in range(left.shape[1]):
        known = np.isfinite(left[:, j])
        moves = known & (np.abs(own.v[:, j]) > moving)
        stands = known & ~moves
        if known.sum() < FEWEST:
            numbers.append((np.full(4, nan), nan, np.full(6, nan), nan, nan))
            continue
        counted = moves if moves.sum() >= FEWEST else known
        variances = _variances(columns[counted, j], left[counted, j])
        at_rest = np.mean(np.square(left[stands, j])) if stands.sum() >= FEWEST else 0.0
        straight = np.linalg.lstsq(line[counted, j], added[counted, j])[0]
        most = (np.quantile(np.abs(x[known, j]), _RANGE) for x in (own.v, own.load))
        numbers.append((variances, at_rest, straight, *most))
    coefficients, standing, nearest, speed, load = map(np.array, zip(*numbers, strict=True))
    lower, upper = own.q.min(axis=0), own.q.max(axis=0)
    return Validity(coefficients, standing, nearest, speed, load, lower, upper, moving, smear)


def _variances(columns: Array, left: Array) -> Array:
    """c₀ … c₃ (4,), with the share of the mean square in c₀."""
    squares = np.square(left)
    columns = columns * [1.0, 1.0, 1.0, columns[:, 3].max() > _REVERSES**2]
    coefficients = (1.0 - _MEAN) * variance_coefficients(columns, squares)
    coefficients[0] += _MEAN * squares.mean()
    return coefficients


def _states_in(trace: TorqueTrace) -> States:
    return States(trace.q, trace.v, trace.a, trace.load, trace.predicted)


def states_of(series: Series, found: Prediction) -> States:
    """Of a series and what a model predicts for it."""
    return States(series.q, series.v, series.a, found.load, found.torque)


def _series_of(trace: TorqueTrace) -> Series:
    return Series(trace.t, trace.q, trace.v, trace.a, RunId(trace.run))


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
        self.validity = validity_of(stored.traces, stored.processing)
        # B (P + k, m) of the covariance B Bᵀ of φ and the effects; None where it is not known.
        self.root = self._root_of(stored)
        self._traces = stored.traces

    def deviation(self, series: Series, found: Prediction) -> Array:
        """s (T, n) [N·m] (N) of the torque that was `found`."""
        return self.validity.deviation(states_of(series, found), self.by_parameters(series))

    def usual(self) -> float:
        """RMS of s over RMS of the torque where joints move, mean over joints, on the own data.

        On those held out, if any; NaN where nothing moves.
        """
        squares, torque = 0.0, 0.0
        held = [trace for trace in self._traces if trace.held_out]
        for trace in held or self._traces:
            d = self.by_parameters(_series_of(trace))
            s = self.validity.deviation(_states_in(trace), d)
            moves = self.validity.moves(trace.v) & np.isfinite(s)
            squares = squares + np.square(np.where(moves, s, 0.0)).sum(axis=0)
            torque = torque + np.square(np.where(moves, trace.predicted, 0.0)).sum(axis=0)
        known = np.asarray(torque) > 0.0
        shares = np.sqrt(np.asarray(squares)[known] / np.asarray(torque)[known])
        return float(shares.mean()) if known.any() else nan

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
            columns = columns + np.square(self._effects(_series_of(each))).sum(axis=0)
            torque = torque + np.square(np.nan_to_num(each.measured)).sum(axis=0)
        share = np.asarray(columns) / np.maximum(np.asarray(torque), 1e-300)[:, None]
        return np.asarray(np.sqrt(share.max(axis=0, initial=0.0)))
