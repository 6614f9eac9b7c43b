"""Essential parameters: what is left when parameters that the data hardly fix are dropped.

Stepwise (Pham & Gautier 1991): while the largest relative standard deviation is more than `ratio`
times the smallest, its parameter is set to zero and the rest fitted again. A model that predicts
as well with fewer parameters; a dropped parameter is small *or* badly excited.
"""

import numpy as np

from excite_cli.identification.factors import Mask, solve, triangle_of
from excite_cli.robot.model import Array

RATIO = 10.0
# Parameters fixed to this share are never dropped.
_WELL_KNOWN = 0.2


def essential_parameters(
    factor: Array, inflation: Array, candidates: Mask, ratio: float = RATIO
) -> tuple[Mask, Array]:
    """Which parameters (p,) are essential, and x (p,) fitted with those alone.

    Parameters
    ----------
    factor: (p+1, p+1) of rows divided by their noise
    inflation: (p,) variance over the one for independent samples, from the full fit
    candidates: (p,) parameters that may be dropped
    """
    p = len(factor) - 1
    kept = np.ones(p, bool)
    while True:
        at = np.flatnonzero(kept)
        part = triangle_of(factor[:, np.append(at, p)])
        solution = solve(part[: len(at) + 1])
        std = np.sqrt(np.diag(solution.inverse) * inflation[at])
        size = np.abs(solution.x)
        relative = np.where(size > 0, std / np.where(size > 0, size, 1.0), np.inf)
        relative[~solution.seen] = np.inf
        limit = max(ratio * float(relative.min(initial=np.inf)), _WELL_KNOWN)
        loose = np.where(candidates[at], relative, 0.0)
        if not len(at) or loose.max(initial=0.0) <= limit:
            x = np.zeros(p)
            x[at] = solution.x
            return kept, x
        kept[at[int(np.argmax(loose))]] = False
