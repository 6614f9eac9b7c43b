"""Torque that repeats over the joint's angle: gear teeth, poles of the motor, a bent shaft.

    τ_j = c cos(N q_j) + s sin(N q_j) = A cos(N q_j − φ),     N periods per turn.

N is searched where it shows, over the angle: for each N of a fine grid the two columns are fitted
to the residual r, and the energy that they explain is a Lomb–Scargle periodogram,

    [C D] M⁻¹ [C D]ᵀ,   C + iD = Σ r exp(iNq),   M from P = Σ exp(2iNq).

Grids are equidistant, so exp(iNq) factorises in two short sets of powers and the sums are one
matrix product.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from excite_cli.effects.angle_curve import powers_of_angle, way_travelled
from excite_cli.effects.base import (
    Abscissa,
    Cotangents,
    Effect,
    Parameter,
    Signals,
    Tier,
    Value,
    deviation,
)
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array, Robot

_CYCLES = 1.0  # least number of periods within the travelled range
_SLOW = 3.0  # cycles below which a cubic in q would take the ripple away
_SAMPLES = 4.0  # least number of samples per period at the typical speed
_MOST = 1000.0  # periods per turn
_OVERSAMPLING = 4
_FINER = (0.35, 0.15, 0.06, 0.02, 0.006)  # cycles
_FOUND = 3  # candidates that a search returns
_TRIED, _ENOUGH = 17, 2000  # slow N, and samples that are enough for them


class Ripple(Effect):
    """τ_j = cos · cos(N q_j) + sin · sin(N q_j) with N = `periods` per turn."""

    kind: ClassVar = "ripple"
    title: ClassVar = "ripple over the angle"
    signature: ClassVar = "the residual repeats at the same angles, in both directions of travel"
    function_of: ClassVar = ("position",)
    parameters: ClassVar = (
        Parameter("cos", "N·m", 0.02, 20.0, part_of_torque=True),
        Parameter("sin", "N·m", 0.02, 20.0, part_of_torque=True),
    )
    shapes: ClassVar = (Parameter("periods", "1/turn", 1.0, _MOST),)
    defaults: ClassVar[Mapping[str, float]] = {"periods": 20.0}
    tier: ClassVar = Tier.LAST

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Every N that these data tell apart, from two cycles over the travelled range."""
        low, high, step = _span(joints[0], signals)
        return [{"periods": float(n)} for n in np.arange(low, high + 1e-9, step)]

    @classmethod
    def tuned(
        cls,
        robot: Robot,
        joints: tuple[int, ...],
        signals: Sequence[Signals],
        residuals: Sequence[Array],
    ) -> list[dict]:
        """Up to four N: the highest peak, those that stand out most around it, and a slow one.

        The second rule finds a line on a residual that is large at low N for other reasons.
        """
        j = joints[0]
        low, high, step = _span(j, signals)
        if not high > low:
            return []
        q = np.concatenate([s.q[:, j] for s in signals])
        v = np.concatenate([s.v[:, j] for s in signals])
        r = _without_slow(q, v, np.concatenate([np.asarray(x)[:, j] for x in residuals]))
        periods, power = periodogram(q, r, low, high, step / _OVERSAMPLING)
        around = median_filter(power, size=16 * _OVERSAMPLING + 1, mode="nearest")
        peaks = _peaks(power)
        by_power = peaks[np.argsort(-power[peaks])][:1]
        ratio = power[peaks] / np.maximum(around[peaks], 1e-12 * power.max() + 1e-300)
        chosen: list[float] = []
        for peak in (*by_power, *peaks[np.argsort(-ratio)]):
            n = float(periods[peak])
            if len(chosen) < _FOUND and all(abs(n - other) > step for other in chosen):
                chosen.append(n)
        found = [_refined(q, r, n, step) for n in chosen]
        whole = np.concatenate([np.asarray(x)[:, j] for x in residuals])
        found.append(_slow(q, v, whole, low, min(_SLOW * step, high)))
        return [{"periods": n} for n in found]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """Parts of a cycle more or less over the travelled range."""
        low, high = way_travelled(self.joints[0], signals)
        return [2 * np.pi * cycles / max(high - low, 1e-6) for cycles in _FINER]

    def columns(self, signals: Signals) -> Array:
        """cos(N q_j) and sin(N q_j), (T, 1, 2)."""
        angle = self.shape["periods"] * signals.q[:, self.joints[0]]
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """c cos N q_j + d sin N q_j."""
        j, (c, d) = self.joints[0], map(real, values)
        angle = f"{real(self.shape['periods'])} * q[{j}]"
        return f"tau[{j}] += {c} * cos({angle}) + {d} * sin({angle});"

    def curve(self, signals: Signals, every: Sequence[Signals]) -> Array | None:
        """Powers of the angle up to the fourth, where less than three periods are seen."""
        low, high = way_travelled(self.joints[0], every)
        if self.shape["periods"] * (high - low) > 2 * np.pi * _SLOW:
            return None
        return powers_of_angle(self.joints[0], signals, every)[:, None]

    def abscissa(self, signals: Signals) -> Abscissa:
        """The angle, folded into one period."""
        period = 2 * np.pi / self.shape["periods"]
        return Abscissa("angle within a period", "rad", signals.q[:, self.joints[0]], period)

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂q_j = N (weight of sin · cos − weight of cos · sin)."""
        j, n = self.joints[0], self.shape["periods"]
        angle = n * signals.q[:, j]
        slope = n * (weights[:, 0, 1] * np.cos(angle) - weights[:, 0, 0] * np.sin(angle))
        return Cotangents(q=signals.only(j, slope))

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Also `amplitude` A and `phase` φ of A cos(N q − φ), deviations to first order."""
        found = super().report(values, covariance)
        c, s = (float(value) for value in values)
        amplitude = float(np.hypot(c, s))
        if amplitude > 0:
            along, across = np.array([c, s]) / amplitude, np.array([-s, c]) / amplitude**2
            found["amplitude"] = Value(amplitude, deviation(along, covariance), "N·m")
            found["phase"] = Value(float(np.arctan2(s, c)), deviation(across, covariance), "rad")
        return found


def periodogram(
    q: Array, residual: Array, low: float, high: float, step: float
) -> tuple[Array, Array]:
    """Energy of the residual that cos(N q) and sin(N q) explain.

    Parameters
    ----------
    q, residual: (T,)
    low, high, step: grid of N [1/turn]

    Returns
    -------
    periods, energy: (K,) each; energy is at most ‖residual − its mean‖²
    """
    count = int(np.floor((high - low) / step + 1e-9)) + 1
    width = int(np.ceil(np.sqrt(count)))
    fine = np.exp(1j * np.outer(q, step * np.arange(width)))
    coarse = np.exp(1j * np.outer(q, low + step * width * np.arange(-(-count // width))))
    centred = residual - residual.mean()
    first = ((coarse * centred[:, None]).T @ fine).ravel()[:count]
    double = ((coarse**2).T @ fine**2).ravel()[:count]
    cc, ss = (len(q) + double.real) / 2, (len(q) - double.real) / 2
    cs = double.imag / 2
    determinant = np.maximum(cc * ss - cs**2, 1e-6 * len(q) ** 2)
    c, d = first.real, first.imag
    energy: Array = (ss * c**2 - 2 * cs * c * d + cc * d**2) / determinant
    periods: Array = low + step * np.arange(count, dtype=np.float64)
    return periods, energy


def _without_slow(q: Array, v: Array, residual: Array) -> Array:
    """The residual less a cubic in q and friction, whose leakage would hide a line."""
    x = (q - q.mean()) / (np.ptp(q) + 1e-300)
    slow = np.stack([np.ones_like(x), x, x**2, x**3, v, np.sign(v), x * v], axis=-1)
    found: Array = residual - slow @ np.linalg.lstsq(slow, residual, rcond=None)[0]
    return found


def _slow(q: Array, v: Array, residual: Array, low: float, high: float) -> float:
    """The N of the least squares beside gravity of one link and friction."""
    every = max(len(q) // _ENOUGH, 1)
    q, v, residual = q[::every], v[::every], residual[::every]
    beside = np.stack([np.ones_like(q), np.cos(q), np.sin(q), v, np.sign(v)], axis=-1)
    left, periods = [], np.linspace(low, high, _TRIED)
    for n in periods:
        columns = np.column_stack([beside, np.cos(n * q), np.sin(n * q)])
        rest = residual - columns @ np.linalg.lstsq(columns, residual, rcond=1e-9)[0]
        left.append(float(rest @ rest))
    return float(periods[int(np.argmin(left))])


def _refined(q: Array, residual: Array, near: float, step: float) -> float:
    """The N of the peak next to `near`, to 1/200 of what the data tell apart."""
    half = step / _OVERSAMPLING
    for _ in range(2):
        periods, energy = periodogram(q, residual, near - half, near + half, half / 8)
        near, half = float(periods[np.argmax(energy)]), half / 8
    return near


def _span(j: int, signals: Sequence[Signals]) -> tuple[float, float, float]:
    """Least and largest N and the distance of two N that differ by a cycle over the range."""
    runs = [s for s in signals if len(s.t) > 2]
    if not runs:
        return 1.0, 0.0, 1.0
    travelled = max(s.q[:, j].max() for s in runs) - min(s.q[:, j].min() for s in runs)
    speed = np.abs(np.concatenate([s.v[:, j] for s in runs]))
    fastest = float(speed.max())
    if travelled <= 0 or fastest <= 0:
        return 1.0, 0.0, 1.0
    typical = float(np.median(speed[speed >= 0.1 * fastest]))
    sampling = max(float(s.t[1] - s.t[0]) for s in runs)
    step = 2 * np.pi / travelled
    high = min(2 * np.pi / (_SAMPLES * sampling * typical), _MOST)
    return _CYCLES * step, float(high), float(step)


def _peaks(power: Array) -> NDArray[np.intp]:
    """Indices of local maxima, ends included."""
    padded = np.concatenate([[-np.inf], power, [-np.inf]])
    return np.flatnonzero((power >= padded[:-2]) & (power >= padded[2:]))
