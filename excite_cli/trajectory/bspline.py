"""Clamped B-splines with uniform inner knots: q(t) = Σ_i c_i N_i(t), c_i the control points."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from excite_cli.trajectory.base import Array, Trajectory


@dataclass(frozen=True)
class BSplineTrajectory(Trajectory):
    """`control_points` per joint, of the given polynomial degree, over `duration` [s]."""

    duration: float
    control_points: int
    degree: int = 5
    at_rest: bool = True

    @property
    def n_coefficients(self) -> int:
        """One per control point."""
        return self.control_points

    @cached_property
    def _splines(self) -> tuple[BSpline, ...]:
        """The basis splines and all their derivatives."""
        inner = np.linspace(0.0, self.duration, self.control_points - self.degree + 1)
        knots = np.concatenate([np.zeros(self.degree), inner, np.full(self.degree, self.duration)])
        spline = BSpline(knots, np.eye(self.control_points), self.degree)
        return (spline, *(spline.derivative(order) for order in range(1, self.degree + 1)))

    @property
    def smooth_orders(self) -> int:
        """The degree: pieces between knots are polynomials."""
        return self.degree

    @property
    def breaks(self) -> Array:
        """The knots."""
        return np.linspace(0.0, self.duration, self.control_points - self.degree + 1)

    def derivative(self, times: Array, order: int) -> Array:
        """Basis splines differentiated; instants beyond the end are evaluated at the end."""
        return np.asarray(self._splines[order](np.clip(times, 0.0, self.duration)))

    def slowed(self, factor: float) -> "BSplineTrajectory":
        """A longer duration."""
        return replace(self, duration=self.duration / factor)

    def constant(self, q: Array) -> Array:
        """All control points equal (the splines sum to one)."""
        return np.tile(np.asarray(q, dtype=float), (self.control_points, 1))

    def sampling_factor(self, samples: int, step: float) -> float | None:
        """Samples of a spline alone prove nothing between them."""
        return None
