"""How far several fitted parameters may be off by chance: lengths and distances in their errors."""

from functools import cache

import numpy as np

# Chance of a true effect to look impossible by the error of the fit, and be refused.
_CHANCE = 0.01


@cache
def two_deviations(count: int) -> float:
    """Length that `count` unit normals exceed as rarely as one exceeds two deviations."""
    from scipy.stats import chi2  # slow to import

    return float(np.sqrt(chi2.isf(chi2.sf(4.0, 1), count)))


@cache
def unlikely_distance(count: int) -> float:
    """χ² distance that `count` parameters of a possible effect seldom have from possible ones."""
    from scipy.stats import chi2  # slow to import

    return float(chi2.isf(_CHANCE, count))
