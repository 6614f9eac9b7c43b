"""Cholesky factors of the many small normal matrices of a search, by LAPACK itself.

On matrices of 60 columns scipy's functions spend as long on their arguments as on the work.
"""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from excite_cli.robot.model import Array

# On the diagonal of a normal matrix of normalised columns, so that what data do not show stays
# where it is. No more than this: parameters that data do show may have 1e-10 of their columns'
# energy to themselves.
RIDGE = 1e-13


class Cholesky:
    """The factor of a symmetric positive definite matrix (k, k)."""

    def __init__(self, matrix: Array) -> None:
        """Raise LinAlgError where `matrix` is not positive definite."""
        self._factor, wrong = dpotrf(matrix.T, lower=1, clean=0)
        if wrong:
            raise np.linalg.LinAlgError(f"column {wrong} of {len(matrix)} depends on those before")

    def solve(self, rhs: Array) -> Array:
        """The solution (k,) or (k, m) for right sides of that shape."""
        return np.asarray(dpotrs(self._factor, rhs, lower=1)[0])
