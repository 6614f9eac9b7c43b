"""From one state to another: the polynomial of degree five with given q, v, a at both ends.

With s = t/T, and p_i the polynomials whose state at one end is one and at the other zero,

    q(t) = p_1(s) q_0 + p_2(s) T v_0 + p_3(s) T² a_0 + p_4(s) q_1 + p_5(s) T v_1 + p_6(s) T² a_1
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.trajectory.base import Array, Trajectory
from excite_cli.trajectory.slowed import Slowed

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

    def sampling_factor(self, samples: int, step: float) -> float | None:
        """Samples prove nothing between them."""
        return None


def at_rest_between(start: Array, end: Array) -> Array:
    """Coefficients (6, n) from rest at `start` to rest at `end`, both (n,)."""
    still = np.zeros_like(start, dtype=float)
    return np.array([start, still, still, end, still, still])
