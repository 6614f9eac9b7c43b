"""Thresholds of a collision detector: how large a residual may be, by joint, speed and load.

The residual r = τ − τ̂ passes a causal first-order low pass (time constant T). What is left of it in
sound runs grows with speed and load, and at reversals, where friction is known least:

    s_j² = c₀ + c₁ v_j² + c₂ load_j² + c₃ exp(−(v_j/w)²),    c ≥ 0 by least squares of r̃_j².

The threshold is s_j times a level x_j. Maxima of |r̃_j|/s_j over a second follow an exponential law
above their median u (what maxima of most noises come to), with β their mean excess; λ false alarms
an hour on n joints ask for  x_j = u + β ln(n · 3600 / (2 λ)).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from excite_cli.errors import ConfigError
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Shown

REVERSAL = 0.05  # rad/s: friction is known least below
_HOUR = 3600.0
_FEWEST = 30  # seconds of sound data
_LEAST = 1e-3  # of the mean square: no speed or load is without any residual


@dataclass(frozen=True)
class Residual:
    """A run for the detector: `residual`, `speed`, `load`, each (T, n), every `step` [s]."""

    residual: Array
    speed: Array
    load: Array
    step: float


@dataclass(frozen=True, repr=False)
class Thresholds(Shown):
    """Of every joint the `coefficients` c₀ … c₃ (n, 4) of s², and the `level` x (n,).

    `false_alarms` an hour that they are made for, on all joints together; `time_constant` [s].
    """

    joint_names: tuple[str, ...]
    coefficients: Array
    level: Array
    false_alarms: float
    time_constant: float

    def at(self, speed: Array, load: Array) -> Array:
        """Thresholds (T, n) [N·m] (N) of the filtered residual."""
        return self.level * np.sqrt(squares_of(self.coefficients, speed, load))

    def filtered(self, residual: Array, step: float) -> Array:
        """The residual (T, n) behind the low pass."""
        return low_pass(residual, step, self.time_constant)

    def beyond(self, run: Residual) -> Array:
        """|r̃| over its threshold (T, n): above 1 the detector speaks."""
        return np.abs(self.filtered(run.residual, run.step)) / self.at(run.speed, run.load)

    def as_data(self) -> dict[str, object]:
        """Plain values for files and JSON, with the formula."""
        return {
            "formula": "level * sqrt(c[0] + c[1]*speed^2 + c[2]*load^2 + "
            f"c[3]*exp(-(speed/{REVERSAL})^2)) of the residual behind a first-order low pass",
            "time_constant": self.time_constant,
            "false_alarms_per_hour": self.false_alarms,
            "joints": {
                name: {"c": list(map(float, c)), "level": float(x)}
                for name, c, x in zip(self.joint_names, self.coefficients, self.level, strict=True)
            },
        }


def thresholds_of(
    joint_names: Sequence[str],
    runs: Sequence[Residual],
    false_alarms: float = 1.0,
    time_constant: float = 0.02,
) -> Thresholds:
    """Thresholds from sound runs.

    Raises
    ------
    ConfigError
        There is less than half a minute of data; rate or time constant are not positive.
    """
    if not (false_alarms > 0.0 and time_constant > 0.0):
        raise ConfigError("false alarms an hour and the time constant [s] must be positive.")
    seconds = sum(len(run.residual) * run.step for run in runs)
    if seconds < _FEWEST:
        raise ConfigError(
            f"thresholds: {seconds:.0f} s of usable data (ends are cut) are too few for a rate per "
            f"hour. Give at least {_FEWEST} s, better some minutes."
        )
    smooth = [low_pass(run.residual, run.step, time_constant) for run in runs]
    n = len(joint_names)
    coefficients, level = np.zeros((n, 4)), np.zeros(n)
    for j in range(n):
        square = np.concatenate([np.square(x[:, j]) for x in smooth])
        speed = np.concatenate([run.speed[:, j] for run in runs])
        load = np.concatenate([run.load[:, j] for run in runs])
        coefficients[j] = variance_coefficients(_columns(speed, load), square)
    maxima = []
    for run, x in zip(runs, smooth, strict=True):
        ratio = np.abs(x) / np.sqrt(squares_of(coefficients, run.speed, run.load))
        length = max(1, round(1.0 / run.step))
        whole = len(ratio) // length * length
        if whole:
            maxima.append(ratio[:whole].reshape(-1, length, n).max(axis=1))
    together = np.concatenate(maxima)
    middle = np.median(together, axis=0)
    above = np.maximum(together - middle, 0.0)
    excess = above.sum(axis=0) / np.maximum((above > 0.0).sum(axis=0), 1)
    level = middle + excess * np.log(n * _HOUR / (2.0 * false_alarms))
    return Thresholds(tuple(joint_names), coefficients, level, false_alarms, time_constant)


def low_pass(x: Array, step: float, time_constant: float) -> Array:
    """First-order, causal, along time (T, n); it begins at the first value."""
    from scipy.signal import lfilter  # takes a second to import

    share = 1.0 - np.exp(-step / time_constant)
    begin = (1.0 - share) * x[:1]
    return np.asarray(lfilter([share], [1.0, share - 1.0], x, axis=0, zi=begin)[0])


def variance_coefficients(columns: Array, squares: Array) -> Array:
    """c ≥ 0 (k,) of s² = columns (m, k) · c by least squares of residuals' `squares` (m,).

    c₀ is at least a thousandth of their mean.
    """
    mean, size = float(squares.mean()), np.maximum(columns.mean(axis=0), 1e-300)
    found, _ = nnls(columns / size, squares / max(mean, 1e-300))
    coefficients = np.asarray(found / size * mean)
    coefficients[0] = max(coefficients[0], _LEAST * mean)
    return coefficients


def squares_of(coefficients: Array, speed: Array, load: Array) -> Array:
    """s² (T, n) of coefficients (n, 4), speeds and loads (T, n)."""
    return np.einsum("tjc,jc->tj", _columns(speed, load), coefficients)


def _columns(speed: Array, load: Array) -> Array:
    reversal = np.exp(-np.square(speed / REVERSAL))
    return np.stack([np.ones_like(speed), speed**2, load**2, reversal], axis=-1)
