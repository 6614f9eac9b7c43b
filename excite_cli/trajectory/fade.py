"""A periodic motion that swells from rest at a posture, or dies away to it.

    q(t) = q_s + w(t) (q_m(t) − q_s)

over whole periods of q_m, with w a polynomial of degree five from 0 to 1 (or back) that has no
velocity and no acceleration at its ends: at one end the robot rests at q_s, at the other it is in
the state of the motion.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from excite_cli.errors import ConfigError
from excite_cli.shown.answer import Shown
from excite_cli.trajectory.base import Array, Trajectory
from excite_cli.trajectory.fourier import FourierTrajectory
from excite_cli.trajectory.point_to_point import Slowed

# Trajectories one after the other: an entry, a motion played several times, a return.


@dataclass(frozen=True, repr=False)
class Segment(Shown):
    """One trajectory with its coefficients (K, n); `name` says what it is for."""

    name: str
    trajectory: Trajectory
    coefficients: Array

    def at(self, t: float | Array) -> tuple[Array, Array, Array]:
        """Positions, speeds, accelerations at any time: (n,) each at t [s], (T, n) at t (T,).

        Raises
        ------
        ConfigError
            A time is before the start or after the end.
        """
        times, end = np.asarray(t, dtype=float), self.trajectory.duration
        if times.ndim > 1 or not ((times >= 0.0) & (times <= end * (1.0 + 1e-12))).all():
            raise ConfigError(
                f"{self.name}: give t from 0 to {end:g} s, a number or (T,); of a motion that "
                "repeats, t % duration."
            )
        q, v, a = self.trajectory.states(np.atleast_1d(times), self.coefficients)
        return (q, v, a) if times.ndim else (q[0], v[0], a[0])


@dataclass(frozen=True)
class Chain:
    """Segments played without a break; each starts where and as fast as the one before it ends."""

    segments: tuple[Segment, ...]

    @property
    def starts(self) -> Array:
        """Instants (S + 1,) [s] at which segments start, then the end."""
        durations = [segment.trajectory.duration for segment in self.segments]
        return np.concatenate([[0.0], np.cumsum(durations)])

    @property
    def duration(self) -> float:
        """Of the whole chain [s]."""
        return float(self.starts[-1])

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) at `times` (T,) [s] within the chain; ends belong to what follows."""
        times = np.clip(np.asarray(times, dtype=float), 0.0, self.duration)
        at = np.searchsorted(self.starts[1:-1], times, side="right")
        found = np.empty((3, len(times), self.segments[0].coefficients.shape[1]))
        for index in np.unique(at).tolist():
            segment, inside = self.segments[index], at == index
            local = times[inside] - self.starts[index]
            found[:, inside] = segment.trajectory.states(local, segment.coefficients)
        return found[0], found[1], found[2]


_WEIGHT = np.polynomial.Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
_DEGREE = 5


@dataclass(frozen=True)
class Fade(Trajectory):
    """Swells over `periods` of `motion`; dies away if `out`.

    Coefficient rows: those of the motion, then the posture q_s.
    """

    motion: FourierTrajectory
    periods: int
    out: bool = False
    at_rest: bool = False

    @property
    def duration(self) -> float:  # type: ignore[override]
        """That of all periods [s]."""
        return self.periods * self.motion.duration

    @property
    def n_coefficients(self) -> int:
        """Those of the motion and one."""
        return self.motion.n_coefficients + 1

    @property
    def smooth_orders(self) -> int:
        """As the motion; what is beyond is bounded."""
        return self.motion.smooth_orders

    def _weight(self, times: Array, order: int) -> Array:
        """Derivative (T, 1) of w [1/s^order]."""
        share = np.clip(np.asarray(times, dtype=float) / self.duration, 0.0, 1.0)
        sign = 1.0
        if self.out:
            share, sign = 1.0 - share, (-1.0) ** order
        value = _WEIGHT.deriv(order)(share) if order else _WEIGHT(share)
        return np.asarray(sign * value / self.duration**order)[:, None]

    def derivative(self, times: Array, order: int) -> Array:
        """The motion's basis times w, then 1 − w, by Leibniz' rule."""
        times = np.asarray(times, dtype=float)
        of_motion = sum(
            comb(order, j) * self._weight(times, j) * self.motion.derivative(times, order - j)
            for j in range(min(order, _DEGREE) + 1)
        )
        of_posture = float(order == 0) - self._weight(times, order)
        return np.hstack([of_motion, of_posture])

    def beyond(self, coefficients: Array) -> Array:
        """Leibniz' rule with the largest value of each factor."""
        order = self.smooth_orders + 1
        largest = np.zeros(coefficients.shape[1])
        for j in range(min(order - 1, _DEGREE) + 1):
            weight = _largest_weight(j) / self.duration**j
            largest += comb(order, j) * weight * self._largest_motion(coefficients[:-1], order - j)
        return largest

    def _largest_motion(self, coefficients: Array, order: int) -> Array:
        """Σ_k (kω)^order √(a_k² + b_k²), a bound (n,) on that derivative of the motion."""
        harmonics = self.motion.harmonics
        rates = self.motion.base_frequency * np.arange(1, harmonics + 1)
        sines, cosines = coefficients[:harmonics], coefficients[harmonics:-1]
        return np.asarray(rates**order @ np.hypot(sines, cosines))

    def slowed(self, factor: float) -> Slowed:
        """The same at another pace."""
        return Slowed(self, factor)

    def constant(self, q: Array) -> Array:
        """The motion standing at the posture itself."""
        return np.vstack([self.motion.constant(q), q])


def _largest_weight(order: int) -> float:
    """Largest magnitude of a derivative of w over its share of time, 0 to 1."""
    polynomial = _WEIGHT.deriv(order) if order else _WEIGHT
    turns = polynomial.deriv().roots() if polynomial.degree() > 1 else np.zeros(0)
    inside = turns[np.isreal(turns)].real
    at = np.concatenate([[0.0, 1.0], inside[(inside > 0.0) & (inside < 1.0)]])
    return float(np.abs(polynomial(at)).max())
