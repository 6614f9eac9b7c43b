"""What rounded torques leave uncertain: an error that stays while the recorded torque stays.

A torque that is recorded in steps of s is wrong by what is uniform within ± s/2. Between two
changes of the recorded value the error is taken for one number of variance s²/12, independent from
stretch to stretch: an error that a slow motion does not average out.
"""

import numpy as np
from scipy.sparse import csr_matrix

from excite_cli.measurement.dataset import Array

_MATTERS = 0.01  # RMS of the rounding, as a share of the torque's standard deviation


def rounding_of(averages: csr_matrix, tau: Array, step: float) -> csr_matrix | None:
    """Q (M, K): the error of averaged torques is Q z, with z of unit variance; None if negligible.

    `tau` (T,) as recorded in steps of `step` [N·m], `averages` (M, T).
    """
    size = step / np.sqrt(12.0)
    if not size > _MATTERS * np.std(tau):
        return None
    level = np.round(tau / step)
    stretch = np.concatenate([[0], np.cumsum(np.diff(level) != 0)]).astype(np.intp)
    here = np.arange(len(tau))
    one = csr_matrix((np.full(len(tau), size), (here, stretch)), (len(tau), int(stretch[-1]) + 1))
    return (averages @ one).tocsr()
