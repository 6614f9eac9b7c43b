"""A number for every sample of a run that only the very same positions and torques share."""

import numpy as np
from numpy.typing import NDArray

from excite_cli.measurement.dataset import Run

_FACTOR = np.uint64(0xD6E8FEB86659FD93)
_SHIFT = np.uint64(32)


def row_hashes(run: Run) -> NDArray[np.uint64]:
    """Hashes (T,) of all digits of q and tau; time does not count."""
    found = np.zeros(len(run.t), np.uint64)
    for values in (run.q, run.tau):
        for column in np.asarray(values, dtype=float).T:
            bits = (column + 0.0).view(np.uint64)  # -0 and 0 are the same
            found = (found ^ bits) * _FACTOR
            found ^= found >> _SHIFT
    return found
