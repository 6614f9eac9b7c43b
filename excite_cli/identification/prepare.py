"""From raw runs to smooth, differentiated motion: zero-phase filters, chosen from the data."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.measurement.dataset import Array


@dataclass(frozen=True)
class PreparedRun:
    """One run (or block of it) ready for regression.

    `t` (T,) from the run's start, `q, v, a` (T, n) filtered and differentiated at the recorded
    rate, borders cut; `tau` (M, n) filtered and decimated, `tau_raw` (T, n) as recorded;
    `usable` (M, n) decimated samples that may be used; `moving` (M, n) where the joint itself moves.
    """

    name: str
    t: Array
    q: Array
    v: Array
    a: Array
    tau_raw: Array
    tau: Array
    usable: NDArray[np.bool_]
    moving: NDArray[np.bool_]
