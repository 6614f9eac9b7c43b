"""Torque that a motor gives while it drives at a speed, as straight lines between given points.

    c(s) = τ_0                                          s ≤ 0: it brakes
    c(s) = τ_i + (τ_{i+1} − τ_i) (s − s_i) / (s_{i+1} − s_i)      s_i ≤ s ≤ s_{i+1}

with s the speed in the direction of the torque. Beyond the last point the last line goes on. What
takes torque away at speed is the voltage that the motor makes itself, which helps it to brake:
braking has all the torque of standing still.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Array, Indices


@dataclass(frozen=True, eq=False)
class EffortCurve:
    """`speeds` (P,) [rad/s or m/s] increase from 0; `efforts` (P,) [N·m or N] do not increase.

    One point alone is a limit that does not depend on speed.
    """

    speeds: Array
    efforts: Array

    @classmethod
    def constant(cls, effort: float) -> "EffortCurve":
        """The same at every speed."""
        return cls(np.zeros(1), np.array([effort]))

    @classmethod
    def falling(cls, effort: float, slope: float) -> "EffortCurve":
        """`effort` at no speed, and `slope` less of it for every unit of speed."""
        if slope == 0.0 or not np.isfinite(effort):
            return cls.constant(effort)
        return cls(np.array([0.0, 1.0]), np.array([effort, effort - slope]))

    @property
    def slopes(self) -> Array:
        """Slope (P,) of the line before each point: 0 before the first, where it brakes."""
        return np.concatenate([[0.0], np.diff(self.efforts) / np.diff(self.speeds)])

    def line(self, speed: Array) -> Indices:
        """Which line each of `speed` is on: that which ends at this point, the last one beyond."""
        at = np.searchsorted(self.speeds, speed, side="left")
        return np.minimum(at, len(self.speeds) - 1)

    def slope(self, speed: Array) -> Array:
        """c'(s) at each of `speed`; at a point, that of the line before it."""
        return np.asarray(self.slopes[self.line(speed)])

    def effort(self, speed: Array) -> Array:
        """c(s) at each of `speed`."""
        at = self.line(speed)
        return np.asarray(self.efforts[at] + self.slopes[at] * (speed - self.speeds[at]))

    def capped(self, most: float) -> "EffortCurve":
        """No more than `most` (above 0) at any speed."""
        if most >= self.efforts[0]:
            return self
        first = int(np.sum(self.efforts >= most))  # of the points that stay
        slope = self.slopes[min(first, len(self.speeds) - 1)]
        if slope == 0.0:
            return EffortCurve.constant(most)
        meets = self.speeds[first - 1] + (most - self.efforts[first - 1]) / slope
        speeds, efforts = self.speeds[first:], self.efforts[first:]
        if not len(speeds):  # the last line goes on
            speeds, efforts = np.array([meets + 1.0]), np.array([most + slope])
        return EffortCurve(np.r_[0.0, meets, speeds], np.r_[most, most, efforts])

    def scaled(self, share: float) -> "EffortCurve":
        """That share of the torque at every speed."""
        return EffortCurve(self.speeds, share * self.efforts)
