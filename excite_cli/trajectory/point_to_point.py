"""From one state to another by a quintic, and any trajectory at another pace.

With s = t/T, and p_i the polynomials whose state at one end is one and at the other zero,

    q(t) = p_1(s) q_0 + p_2(s) T v_0 + p_3(s) T² a_0 + p_4(s) q_1 + p_5(s) T v_1 + p_6(s) T² a_1
"""

from dataclasses import dataclass, replace

import numpy as np

from excite_cli.trajectory.base import Array, Trajectory


@dataclass(frozen=True)
class Slowed(Trajectory):
    """`original` at `pace` times its own pace; coefficients keep their meaning."""

    original: Trajectory
    pace: float

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Longer by 1/pace [s]."""
        return self.original.duration / self.pace

    @property
    def at_rest(self) -> bool:  # type: ignore[override]
        """As the original."""
        return self.original.at_rest

    @property
    def n_coefficients(self) -> int:
        """As the original."""
        return self.original.n_coefficients

    @property
    def smooth_orders(self) -> int:
        """As the original."""
        return self.original.smooth_orders

    @property
    def breaks(self) -> Array:
        """Those of the original, later."""
        return self.original.breaks / self.pace

    def _inner(self, times: Array) -> Array:
        return np.asarray(times, dtype=float) * self.pace

    def orders(self, times: Array, coefficients: Array) -> tuple[Array, Array, Array, Array]:
        """Those of the original at c·t, each times its cᵏ."""
        q, v, a, jerk = self.original.orders(self._inner(times), coefficients)
        return q, v * self.pace, a * self.pace**2, jerk * self.pace**3

    def derivative(self, times: Array, order: int) -> Array:
        """That of the original at c·t, times cᵏ."""
        return self.original.derivative(self._inner(times), order) * self.pace**order

    def derivatives(self, times: Array, coefficients: Array) -> Array:
        """Those of the original at c·t, each times its cᵏ."""
        found = self.original.derivatives(self._inner(times), coefficients)
        return found * (self.pace ** np.arange(len(found)))[:, None, None]

    def beyond(self, coefficients: Array) -> Array:
        """The bound of the original, times c to its order."""
        return self.original.beyond(coefficients) * self.pace ** (self.smooth_orders + 1)

    def slowed(self, factor: float) -> "Slowed":
        """The same with both factors in one."""
        return replace(self, pace=self.pace * factor)

    def constant(self, q: Array) -> Array:
        """As the original."""
        return self.original.constant(q)

    def sampling_factor(self, samples: int, step: float) -> float | None:
        """That of the original at the instants that these become."""
        return self.original.sampling_factor(samples, step * self.pace)


# Powers of s (rows, from 0 to 5) of each of the six polynomials (columns).
_POWERS = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
        [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
        [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
        [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
    ]
)
_ORDERS_OF_TIME = np.array([0, 1, 2, 0, 1, 2])


@dataclass(frozen=True)
class PointToPoint(Trajectory):
    """Coefficient rows: q, v, a at the start, then q, v, a at the end, `duration` [s] later."""

    duration: float
    at_rest: bool = False

    @property
    def n_coefficients(self) -> int:
        """Six."""
        return 6

    @property
    def smooth_orders(self) -> int:
        """Five: one polynomial."""
        return 5

    def derivative(self, times: Array, order: int) -> Array:
        """Exact derivatives; instants beyond the end are evaluated at the end."""
        share = np.clip(np.asarray(times, dtype=float) / self.duration, 0.0, 1.0)
        powers = np.zeros((len(share), 6))
        for power in range(order, 6):
            factor = np.prod(np.arange(power - order + 1, power + 1, dtype=float))
            powers[:, power] = factor * share ** (power - order)
        scale = self.duration ** (_ORDERS_OF_TIME - order).astype(float)
        return np.asarray(powers @ _POWERS * scale)

    def slowed(self, factor: float) -> Slowed:
        """The same at another pace."""
        return Slowed(self, factor)

    def constant(self, q: Array) -> Array:
        """At rest at the same posture at both ends."""
        return at_rest_between(q, q)


def at_rest_between(start: Array, end: Array) -> Array:
    """Coefficients (6, n) from rest at `start` to rest at `end`, both (n,)."""
    still = np.zeros_like(start, dtype=float)
    return np.array([start, still, still, end, still, still])
