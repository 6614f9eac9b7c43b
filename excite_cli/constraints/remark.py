"""What a constraint has to say about itself before work begins."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from excite_cli.geometry.collision_pairs import DroppedPair


@dataclass(frozen=True)
class Remark:
    """A sentence; `important` if a person must know it, else a detail."""

    words: str
    important: bool = False


def counted_reasons(dropped: Sequence[DroppedPair]) -> str:
    """How many pairs were dropped for each reason, figures in the reasons left aside."""
    counts = Counter(pair.reason.split(" (")[0] for pair in dropped)
    return ", ".join(f"{count} {reason}" for reason, count in counts.most_common()) or "none"
