"""The family of trajectories: positions, velocities and accelerations linear in coefficients.

x(t) = B(t) α with α of shape (K, n), one column per joint and the same basis for all joints. So
the derivative of anything with respect to α is Bᵀ times its derivative with respect to x (Eq. 49).
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from excite_cli.arrays import Array as Array
from excite_cli.config.trajectory_spec import BSplineSpec, FourierSpec


@dataclass(frozen=True)
class Basis:
    """Basis functions at T instants and their first three time derivatives, each (T, K)."""

    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array

    @property
    def by_order(self) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration, jerk."""
        return self.position, self.velocity, self.acceleration, self.jerk

    def states(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """q, v, a, each (T, n), for coefficients (K, n)."""
        return (
            self.position @ coefficients,
            self.velocity @ coefficients,
            self.acceleration @ coefficients,
        )

    def orders(self, coefficients: Array) -> tuple[Array, Array, Array, Array]:
        """q and its first three time derivatives, each (T, n), for coefficients (K, n)."""
        return (*self.states(coefficients), self.jerk @ coefficients)

    def pull_back(self, gq: Array, gv: Array, ga: Array) -> Array:
        """Derivative (K, n) by the coefficients, from those by q, v, a (T, n)."""
        return self.position.T @ gq + self.velocity.T @ gv + self.acceleration.T @ ga


class Trajectory(ABC):
    """A family member with its shape fixed (number of functions, duration), coefficients free."""

    duration: float
    at_rest: bool

    @property
    @abstractmethod
    def n_coefficients(self) -> int:
        """K, the number of coefficients per joint."""

    def basis(self, times: Array) -> Basis:
        """Evaluate the basis at `times` (T,) [s]."""
        times = np.asarray(times, dtype=float)
        position, velocity, acceleration, jerk = (self.derivative(times, k) for k in range(4))
        return Basis(times, position, velocity, acceleration, jerk)

    def orders(self, times: Array, coefficients: Array) -> tuple[Array, Array, Array, Array]:
        """q, v, a and jerk (T, n) at `times` (T,) [s]; where many coefficients, without a basis.

        At an instant where jerk jumps, that of what follows.
        """
        return self.basis(times).orders(coefficients)

    def states(self, times: Array, coefficients: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) at `times` (T,) [s]."""
        return self.orders(times, coefficients)[:3]

    @abstractmethod
    def slowed(self, factor: float) -> "Trajectory":
        """The same path at `factor` of its pace: q(factor·t), with the same coefficients."""

    @abstractmethod
    def constant(self, q: Array) -> Array:
        """Coefficients (K, n) of standing still at `q` (n,)."""

    @property
    @abstractmethod
    def smooth_orders(self) -> int:
        """Time derivatives that describe a piece: the degree of a polynomial, else a few."""

    @property
    def breaks(self) -> Array:
        """Instants (P + 1,) [s] between which the motion is one smooth piece."""
        return np.array([0.0, self.duration])

    @abstractmethod
    def derivative(self, times: Array, order: int) -> Array:
        """Time derivative (T, K) of the given order of the basis at `times`."""

    def derivatives(self, times: Array, coefficients: Array) -> Array:
        """q and its time derivatives up to `smooth_orders` at `times` (D + 1, T, n)."""
        orders = range(self.smooth_orders + 1)
        return np.array([self.derivative(times, order) @ coefficients for order in orders])

    def beyond(self, coefficients: Array) -> Array:
        """Bound (n,) on the first derivative that `derivatives` leaves out, at every instant."""
        return np.zeros(coefficients.shape[1])

    def sampling_factor(self, samples: int, step: float) -> float | None:
        """Largest share of a bound that proves it at every instant when kept on the grid.

        None where the samples prove nothing.
        """
        return None

    def rest_rows(self) -> Array:
        """Rows E (4, K): E α = 0 puts velocity and acceleration to zero at start and end."""
        ends = self.basis(np.array([0.0, self.duration]))
        return np.vstack([ends.velocity, ends.acceleration])

    @cached_property
    def free_directions(self) -> Array:
        """N (K, K'): every admissible α is N β; the identity unless the motion starts at rest."""
        if not self.at_rest:
            return np.eye(self.n_coefficients)
        rows = self.rest_rows()
        return null_space(rows / np.linalg.norm(rows, axis=1, keepdims=True), rcond=1e-10)


# How many coefficients a motion gets where the config leaves that open.
#
# More harmonics make better motions (UR10, 12 s: 8.0 with 5, 5.9 with 8, 5.3 with 12, 5.2 with
# 16) until they are faster than what a robot follows or so fast that its acceleration moves
# nothing.

# Below the first resonances of arms and the cutoffs of their controllers.
_FASTEST = 1.5  # Hz
# What a joint's full acceleration should still move it by, at the highest frequency.
_AMPLITUDE = 0.05  # rad or m
_FEWEST, _MOST = 5, 12
# Time of an iteration grows with the square of the variables and more.
_VARIABLES = 450


def with_freedom(
    spec: FourierSpec | BSplineSpec, accelerations: Array
) -> FourierSpec | BSplineSpec:
    """`spec` with its harmonics or control points; `accelerations` (n,) bound those of joints.

    [rad/s² or m/s²], infinite where nothing bounds them.
    """
    if isinstance(spec, FourierSpec):
        if spec.harmonics is not None:
            return spec
        duration = 2 * math.pi / spec.base_frequency
        return spec.model_copy(update={"harmonics": harmonics_for(duration, accelerations)})
    if spec.control_points is not None:
        return spec
    # A series of N harmonics has 2 N + 1 coefficients; at rest, four points are held at the ends.
    points = 2 * harmonics_for(spec.duration, accelerations) + 1 + (4 if spec.at_rest else 0)
    return spec.model_copy(update={"control_points": max(points, spec.degree + 5)})


def harmonics_for(duration: float, accelerations: Array) -> int:
    """N for a motion of `duration` [s] of joints with these bounds (n,) on accelerations."""
    typical = float(np.median(accelerations))
    fastest = min(_FASTEST, math.sqrt(typical / _AMPLITUDE) / (2 * math.pi))
    affordable = (_VARIABLES // len(accelerations) - 1) // 2
    return max(_FEWEST, min(int(fastest * duration), affordable, _MOST))
