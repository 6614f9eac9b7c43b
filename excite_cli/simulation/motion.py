"""A motion to be played: a trajectory with its coefficients, and how it begins and ends.

The robot starts before time zero, in a state of the motion, so that what the controller needs to
settle is not recorded: a periodic motion is played from before its period, any other is entered
and left with constant acceleration.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fourier import FourierTrajectory


@dataclass(frozen=True)
class PlannedMotion:
    """`coefficients` (K, n) of `trajectory`, to be played under `name`."""

    name: str
    trajectory: Trajectory
    coefficients: Array

    @property
    def periodic(self) -> bool:
        """Whether the motion ends as it begins and may go on."""
        return isinstance(self.trajectory, FourierTrajectory)

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) at any times [s], also before the start and after the end."""
        if self.periodic:
            return self.trajectory.basis(times).states(self.coefficients)
        inside = np.clip(times, 0.0, self.trajectory.duration)
        q, v, a = self.trajectory.basis(inside).states(self.coefficients)
        beyond = (times - inside)[:, None]
        return q + v * beyond + 0.5 * a * beyond**2, v + a * beyond, a
