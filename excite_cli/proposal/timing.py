"""How long a motion should be, and how many harmonics it should have."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.proposal.assumed_limits import JointPlan
from excite_cli.trajectory.freedom import harmonics_for

_SHORTEST, _LONGEST = 10.0, 20.0
# How far the slowest joint should come either way: this share of half of its range, at most.
_SHARE, _FAR, _FAR_SLIDE = 0.5, 0.8, 0.1
# Forty instants to a period of the highest harmonic; what lies between them is proved.
_INSTANTS = 200


@dataclass(frozen=True)
class Pace:
    """Seconds of one motion, harmonics, instants of the constraint grid.

    slowest: the joint that asks for so long a motion; None where the usual length is enough.
    """

    duration: float
    harmonics: int
    constraint_samples: int
    slowest: str | None

    @property
    def base_frequency(self) -> float:
        """ω [rad/s]."""
        return 2 * math.pi / self.duration


def choose_pace(joints: Sequence[JointPlan]) -> Pace:
    """The pace that lets the slowest joint use half of its range with the first harmonic."""
    needed = []
    for joint in joints:
        far = min(_SHARE * joint.width / 2, _FAR_SLIDE if joint.sliding else _FAR)
        needed.append(2 * math.pi * far / joint.velocity)
    slowest = int(np.argmax(needed))
    duration = float(math.ceil(min(max(needed[slowest], _SHORTEST), _LONGEST)))
    usual = needed[slowest] <= _SHORTEST
    harmonics = harmonics_for(duration, np.array([joint.acceleration for joint in joints]))
    return Pace(duration, harmonics, _INSTANTS, None if usual else joints[slowest].name)
