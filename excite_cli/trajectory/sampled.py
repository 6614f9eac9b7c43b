"""Motions given as samples: quintic pieces between knots, from positions, speeds, accelerations.

With s ∈ [0, 1] across an interval of length h, and q, v, a at both of its ends,

    q(s) = q₀ + h v₀ s + h² a₀ s²/2 + c₃ s³ + c₄ s⁴ + c₅ s⁵

is the one quintic through all six. Neighbouring pieces share q, v and a: the motion is twice
continuously differentiable. Coefficients are what is known at the knots, so that the family is
linear as the others are; where only q is known, v and a are those of the quintic interpolating
spline, whose pieces these then are (four times continuously differentiable).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import perm

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from excite_cli.trajectory.base import Array, Trajectory

_DEGREE = 5
# Monomials s⁰ … s⁵ from h v₀, h² a₀, q₁ − q₀, h v₁, h² a₁; q₀ is added to the first.
_QUINTIC = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.5, 0.0, 0.0, 0.0],
        [-6.0, -1.5, 10.0, -4.0, 0.5],
        [8.0, 1.5, -15.0, 7.0, -1.0],
        [-3.0, -0.5, 6.0, -3.0, 0.5],
    ]
)


@dataclass(frozen=True, eq=False)
class SampledTrajectory(Trajectory):
    """Knots (M,) [s] from 0 on; coefficient rows q_1 … q_M, v_1 … v_M, a_1 … a_M at the knots.

    `pace` is how fast it is played: knots are passed at t = knots / pace, and the coefficients keep
    their meaning at pace 1.
    """

    knots: Array
    pace: float = 1.0
    at_rest: bool = False

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Time from the first knot to the last [s]."""
        return float(self.knots[-1]) / self.pace

    @property
    def n_coefficients(self) -> int:
        """Three per knot."""
        return 3 * len(self.knots)

    @property
    def smooth_orders(self) -> int:
        """Five."""
        return _DEGREE

    @property
    def breaks(self) -> Array:
        """The knots."""
        return np.asarray(self.knots / self.pace)

    @cached_property
    def _lengths(self) -> Array:
        return np.diff(self.knots)

    def _weights(self, times: Array, orders: range) -> tuple[NDArray[np.intp], Array]:
        """Interval of each instant (T,), and (orders, T, 5) by h v₀ …, in the knots' own units."""
        at = np.clip(np.asarray(times, dtype=float) * self.pace, 0.0, self.knots[-1])
        index = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self.knots) - 2)
        h = self._lengths[index]
        s = (at - self.knots[index]) / h
        scale = np.stack([h, h**2, np.ones_like(h), h, h**2], axis=1)
        found = np.empty((len(orders), len(s), 5))
        for row, order in enumerate(orders):
            powers = np.zeros((len(s), _DEGREE + 1))
            for k in range(order, _DEGREE + 1):
                powers[:, k] = perm(k, order) * s ** (k - order)
            found[row] = powers @ _QUINTIC * scale * ((self.pace / h) ** order)[:, None]
        return index, found

    def _evaluated(self, times: Array, coefficients: Array, orders: range) -> Array:
        index, weights = self._weights(times, orders)
        q, v, a = coefficients.reshape(3, len(self.knots), -1)
        # The difference of positions first: over a millisecond nothing else keeps the digits.
        known = (v[index], a[index], q[index + 1] - q[index], v[index + 1], a[index + 1])
        found = np.einsum("otk,ktn->otn", weights, np.stack(known))
        if orders.start == 0:
            found[0] += q[index]
        return np.asarray(found)

    def orders(self, times: Array, coefficients: Array) -> tuple[Array, Array, Array, Array]:
        """q, v, a, jerk (T, n) from the two knots beside each instant; clamped to the ends."""
        q, v, a, jerk = self._evaluated(times, coefficients, range(4))
        return q, v, a, jerk

    def derivatives(self, times: Array, coefficients: Array) -> Array:
        """q and its first five time derivatives (6, T, n), from the piece that begins at a knot."""
        return self._evaluated(times, coefficients, range(_DEGREE + 1))

    def derivative(self, times: Array, order: int) -> Array:
        """Time derivative (T, K) of the basis, dense: for few knots only, see `orders`."""
        index, weights = self._weights(times, range(order, order + 1))
        count, rows = len(self.knots), np.arange(len(index))
        dense = np.zeros((len(index), self.n_coefficients))
        v0, a0, gained, v1, a1 = weights[0].T
        for offset, values in ((count, v0), (2 * count, a0), (count + 1, v1), (2 * count + 1, a1)):
            dense[rows, offset + index] = values
        dense[rows, index] = (order == 0) - gained
        dense[rows, index + 1] = gained
        return dense

    def constant(self, q: Array) -> Array:
        """`q` at every knot, no speed, no acceleration."""
        still = np.zeros((self.n_coefficients, len(q)))
        still[: len(self.knots)] = q
        return still

    def slowed(self, factor: float) -> "SampledTrajectory":
        """The same path, its knots passed later."""
        return replace(self, pace=self.pace * factor)

    def sampling_factor(self, samples: int, step: float) -> float | None:
        """Samples of polynomial pieces alone prove nothing between them."""
        return None


def through_samples(
    t: Array, q: Array, v: Array | None = None, a: Array | None = None
) -> tuple[SampledTrajectory, Array]:
    """The motion through q (T, n) at increasing t (T,) [s], with its coefficients (3 T, n).

    Speeds and accelerations that are not given come from interpolating splines of degree 5 (lower
    for fewer than 6 samples): of the positions, or of the speeds where these are known.
    """
    t, q = np.asarray(t, dtype=float), np.asarray(q, dtype=float)
    knots = t - t[0]
    degree = min(_DEGREE, len(t) - 1)
    if v is None:
        spline = make_interp_spline(knots, q, k=degree)
        v, a = spline(knots, 1), spline(knots, 2)
    elif a is None:
        a = make_interp_spline(knots, v, k=degree)(knots, 1)
    return SampledTrajectory(knots), np.vstack([q, v, a])
