"""Pairs that a constraint leaves out, counted for what it has to say of itself."""

from collections import Counter
from collections.abc import Sequence

from excite_cli.geometry.reasons import DroppedPair, why_in_words


def counted_reasons(dropped: Sequence[DroppedPair]) -> str:
    """How many pairs were dropped for each reason, figures in the reasons left aside."""
    counts = Counter(pair.reason.why for pair in dropped)
    told = (f"{count} {why_in_words(why)}" for why, count in counts.most_common())
    return ", ".join(told) or "none"
