"""Fourier series (Eq. 50): q(t) = Σ_k a_k sin kωt + b_k cos kωt + q_0, period 2π/ω."""

from dataclasses import dataclass, replace

import numpy as np

from excite_cli.trajectory.base import Array, Basis, Trajectory


@dataclass(frozen=True)
class FourierTrajectory(Trajectory):
    """N harmonics of ω [rad/s]; coefficient rows a_1 … a_N, b_1 … b_N, q_0."""

    harmonics: int
    base_frequency: float
    at_rest: bool = False

    @property
    def duration(self) -> float:  # type: ignore[override]
        """One period [s]."""
        return 2 * np.pi / self.base_frequency

    @property
    def n_coefficients(self) -> int:
        """2 N + 1."""
        return 2 * self.harmonics + 1

    def basis(self, times: Array) -> Basis:
        """Sines, cosines and one constant, differentiated exactly."""
        times = np.asarray(times, dtype=float)
        rates = self.base_frequency * np.arange(1, self.harmonics + 1)
        sine, cosine = np.sin(np.outer(times, rates)), np.cos(np.outer(times, rates))
        one, zero = np.ones((len(times), 1)), np.zeros((len(times), 1))
        return Basis(
            times=times,
            position=np.hstack([sine, cosine, one]),
            velocity=np.hstack([cosine * rates, -sine * rates, zero]),
            acceleration=np.hstack([-sine * rates**2, -cosine * rates**2, zero]),
            jerk=np.hstack([-cosine * rates**3, sine * rates**3, zero]),
        )

    @property
    def smooth_orders(self) -> int:
        """Five: what is beyond is negligible over a few milliseconds, and bounded."""
        return 5

    def derivative(self, times: Array, order: int) -> Array:
        """(kω)^order sin(kωt + order π/2), and the same of the cosine."""
        rates = self.base_frequency * np.arange(1, self.harmonics + 1)
        angle = np.outer(times, rates) + order * np.pi / 2
        last = np.full((len(times), 1), float(order == 0))
        return np.hstack([np.sin(angle) * rates**order, np.cos(angle) * rates**order, last])

    def beyond(self, coefficients: Array) -> Array:
        """Σ_k (kω)⁶ √(a_k² + b_k²)."""
        order = self.smooth_orders + 1
        rates = self.base_frequency * np.arange(1, self.harmonics + 1)
        sines, cosines = coefficients[: self.harmonics], coefficients[self.harmonics : -1]
        return np.asarray(rates**order @ np.hypot(sines, cosines))

    def slowed(self, factor: float) -> "FourierTrajectory":
        """A lower base frequency."""
        return replace(self, base_frequency=self.base_frequency * factor)

    def constant(self, q: Array) -> Array:
        """Only q_0 differs from zero."""
        coefficients = np.zeros((self.n_coefficients, len(q)))
        coefficients[-1] = q
        return coefficients

    def sampling_factor(self, samples: int, step: float) -> float | None:
        """cos(πN/M) when M > 2N samples cover one period exactly (Ehlich and Zeller 1964)."""
        covers = abs(samples * step - self.duration) < 1e-5 * self.duration
        if not covers or samples <= 2 * self.harmonics:
            return None
        return float(np.cos(np.pi * self.harmonics / samples))
