"""Motions that do not count as proved, in words."""

from collections.abc import Sequence
from typing import Any

from excite_cli.excitation.motion import Doubt, Motion
from excite_cli.proof.certificate import Worst

# Worst margins for scripts.


def worst_data(worst: Worst) -> dict[str, Any]:
    """A worst margin for `--json`."""
    return {
        "margin": worst.margin,
        "share": worst.share,
        "unit": worst.unit,
        "where": worst.label,
        "time": worst.time,
        "violations": worst.violations,
    }


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
