"""Motions that do not count as proved, in words."""

from collections.abc import Sequence

from excite_cli.excitation.doubt import Doubt
from excite_cli.excitation.motion import Motion


def doubts_in_words(motions: Sequence[Motion]) -> list[str]:
    """For each reason that there is: `motion 1 is not proved: …`, without a full stop."""
    found: dict[Doubt, list[str]] = {}
    for motion in motions:
        if motion.doubt:
            found.setdefault(motion.doubt, []).append(str(motion.index))
    return [
        f"motion {which[0]} is not proved: {why}"
        if len(which) == 1
        else f"motions {', '.join(which)} are not proved: each {why}"
        for why, which in found.items()
    ]
