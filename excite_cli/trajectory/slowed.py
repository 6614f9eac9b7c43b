"""Any trajectory played at another pace: q(t) = q₀(c·t), derivatives of order k times cᵏ."""

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
