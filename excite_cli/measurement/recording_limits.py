"""What the robot allows: how far, how fast, how strong."""

from dataclasses import dataclass

import numpy as np

from excite_cli.measurement.dataset import Array, Mask


@dataclass(frozen=True)
class RecordingLimits:
    """What the robot allows, (n,) each, infinite where nothing is known; which joints turn."""

    lower: Array
    upper: Array
    velocity: Array
    effort: Array
    revolute: Mask

    @classmethod
    def unknown(cls, n: int) -> "RecordingLimits":
        """No limits, all joints turn."""
        infinite = np.full(n, np.inf)
        return cls(-infinite, infinite, infinite, infinite, np.ones(n, bool))
