"""A motion to be played: a trajectory with its coefficients, and how it begins and ends.

The robot starts before time zero, in a state of the motion, so that what the controller needs to
settle is not recorded: a periodic motion is played from before its period, any other is entered
and left with constant acceleration.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fade import Chain
from excite_cli.trajectory.fourier import FourierTrajectory


@dataclass(frozen=True)
class PlannedMotion:
    """`coefficients` (K, n) of `trajectory`, to be played under `name`."""

    name: str
    trajectory: Trajectory
    coefficients: Array

    @property
    def duration(self) -> float:
        """Of the motion played once [s]."""
        return self.trajectory.duration

    @property
    def number(self) -> bytes:
        """What the motion's noise is drawn from."""
        return self.coefficients.tobytes()

    @property
    def periodic(self) -> bool:
        """Whether the motion ends as it begins and may go on."""
        return isinstance(self.trajectory, FourierTrajectory)

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) at any times [s], also before the start and after the end."""
        if self.periodic:
            return self.trajectory.states(times, self.coefficients)
        inside = np.clip(times, 0.0, self.trajectory.duration)
        q, v, a = self.trajectory.states(inside, self.coefficients)
        beyond = (times - inside)[:, None]
        return q + v * beyond + 0.5 * a * beyond**2, v + a * beyond, a


@dataclass(frozen=True)
class PlannedProgram:
    """Segments one after the other, from rest to rest, to be played once under `name`."""

    name: str
    chain: Chain

    @property
    def duration(self) -> float:
        """Of all segments [s]."""
        return self.chain.duration

    @property
    def number(self) -> bytes:
        """What its noise is drawn from."""
        return b"".join(segment.coefficients.tobytes() for segment in self.chain.segments)

    @property
    def periodic(self) -> bool:
        """It ends: periods are segments of it."""
        return False

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) at any times [s]; at rest before the start and after the end."""
        return self.chain.states(times)


Planned = PlannedMotion | PlannedProgram
