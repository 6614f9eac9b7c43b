"""Stamps of messages: of their headers, or of the recorder where headers are empty."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.measurement.dataset import Finding

Stamps = NDArray[np.int64]


class MessageStamps:
    """Both stamps of every message [ns], whole: an epoch in seconds leaves 0.2 µs of a double."""

    def __init__(self) -> None:
        self._recorded: list[int] = []
        self._stamped: list[int] = []

    def __len__(self) -> int:
        return len(self._recorded)

    def add(self, recorded: int, stamp: Any) -> None:
        """Take those of a message: when it was recorded [ns], and what its header holds."""
        self._recorded.append(recorded)
        self._stamped.append(int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec))

    def chosen(self) -> tuple[Stamps, bool]:
        """Stamps (T,) of the headers; those of the recorder, and true, where headers are empty."""
        stamped = np.array(self._stamped, dtype=np.int64)
        # A first stamp of 0 is a clock that starts there; more of them, a header left empty.
        empty = bool(np.count_nonzero(stamped <= 0) > 1)
        return (np.array(self._recorded, dtype=np.int64) if empty else stamped), empty


def unstamped_finding(topic: str) -> Finding:
    """What is said of empty headers."""
    text = f"header stamps of {topic} are empty: the time of recording is used, which is less even"
    return Finding("stamps", "note", text)
