"""Positions and their first three derivatives of a trajectory over whole intervals of time.

About the middle t_c of an interval of half width h, with t = t_c + s h,

    q(t) = Σ_{k ≤ D} q⁽ᵏ⁾(t_c) (s h)ᵏ / k! + e,     |e| ≤ max|q⁽ᴰ⁺¹⁾| h^(D+1) / (D+1)!

For a polynomial piece of degree D (B-splines between knots) e is zero; for a Fourier series the
last derivative has a bound for all times, the sum of its amplitudes. Terms beyond s² go into the
radius of the enclosure. The same with the derivatives moved on by one, two and three gives v, a and
jerk. Intervals end at the breaks of a trajectory, so that jerk may jump there.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import factorial

import numpy as np
from numpy.typing import NDArray

from excite_cli.proof.taylor import Taylor
from excite_cli.trajectory.base import Array, Trajectory


@dataclass(frozen=True)
class Intervals:
    """Intervals of time: middles (T,) and half widths (T,) [s], each within one smooth piece."""

    middles: Array
    halves: Array

    def __len__(self) -> int:
        return len(self.middles)

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Intervals":
        """Some of them."""
        return Intervals(self.middles[chosen], self.halves[chosen])

    def halved(self) -> "Intervals":
        """Each cut in two."""
        quarter = self.halves / 2
        middles = np.concatenate([self.middles - quarter, self.middles + quarter])
        return Intervals(middles, np.tile(quarter, 2))


@dataclass(frozen=True)
class EnclosedStates:
    """q, v, a and jerk of the moved joints over intervals, each enclosing (T, n)."""

    q: Taylor
    v: Taylor
    a: Taylor
    jerk: Taylor

    def order(self, k: int) -> Taylor:
        """The derivative of q of order k: 0 to 3."""
        return (self.q, self.v, self.a, self.jerk)[k]


def intervals_of(trajectory: Trajectory, width: float) -> Intervals:
    """Intervals not wider than `width` [s] that cover the whole trajectory."""
    parts = []
    breaks = trajectory.breaks
    for begin, end in pairwise(breaks.tolist()):
        count = max(1, int(np.ceil((end - begin) / width - 1e-9)))
        parts.append(np.linspace(begin, end, count + 1))
    begins = np.concatenate([part[:-1] for part in parts])
    ends = np.concatenate([part[1:] for part in parts])
    return Intervals((begins + ends) / 2, (ends - begins) / 2)


def enclosed_states(
    trajectory: Trajectory, coefficients: Array, intervals: Intervals
) -> EnclosedStates:
    """What q, v, a and jerk can be in each of the intervals."""
    derivatives = trajectory.derivatives(intervals.middles, coefficients)
    beyond, h = trajectory.beyond(coefficients), intervals.halves[:, None]
    found = [_enclosed(derivatives[shift:], beyond, h) for shift in range(4)]
    return EnclosedStates(*found)


def _enclosed(derivatives: Array, beyond: Array, h: Array) -> Taylor:
    terms = np.zeros((3, *derivatives.shape[1:]))
    radius = np.broadcast_to(
        beyond * h ** len(derivatives) / factorial(len(derivatives)), terms.shape[1:]
    )
    for order, derivative in enumerate(derivatives):
        term = derivative * h**order / factorial(order)
        if order < 3:
            terms[order] = term
        else:
            radius = radius + np.abs(term)
    return Taylor(terms, radius)
