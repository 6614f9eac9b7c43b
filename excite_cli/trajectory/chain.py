"""Trajectories one after the other: an entry, a motion played several times, a return."""

from dataclasses import dataclass

import numpy as np

from excite_cli.shown.record import Shown
from excite_cli.trajectory.base import Array, Trajectory


@dataclass(frozen=True, repr=False)
class Segment(Shown):
    """One trajectory with its coefficients (K, n); `name` says what it is for."""

    name: str
    trajectory: Trajectory
    coefficients: Array


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
