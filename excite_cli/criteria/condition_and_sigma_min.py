"""Condition number and least singular value together: log(cond + 1/σ_min).

The sum cond + 1/σ_min is the classic criterion of Gautier and Khalil (1992) and one of the forms
that Presse and Gautier [20] compare; the condition number alone does not reward large motions.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.criteria.base import SHARPNESS, Array, Criterion
from excite_cli.criteria.sigma_min import SmoothSigmaMin
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber


class ConditionAndSigmaMin(Criterion):
    """log((σ_max + 1) / σ_min)."""

    name = "condition_and_sigma_min"
    compares_columns = True

    def value(self, sigma: Array) -> float:
        """Logarithm of the sum."""
        return float(np.log(sigma[0] + 1.0) - np.log(sigma[-1]))

    def derivative(self, sigma: Array) -> Array:
        """1/(σ_max + 1) at the largest, −1/σ_min at the smallest."""
        derivative = np.zeros_like(sigma)
        derivative[0] += 1.0 / (sigma[0] + 1.0)
        derivative[-1] -= 1.0 / sigma[-1]
        return derivative

    def continuation(self) -> tuple[Criterion, ...]:
        """Smooth forms with rising p: extreme singular values meet at good optima."""
        return tuple(SmoothConditionAndSigmaMin(p) for p in SHARPNESS)


@dataclass(frozen=True)
class SmoothConditionAndSigmaMin(Criterion):
    """log(exp(smooth log cond) + exp(smooth −log σ_min)) with the p-norm forms of both."""

    p: float
    name = "smooth_condition_and_sigma_min"

    def value(self, sigma: Array) -> float:
        """Sum of the two smooth forms, in logarithms."""
        parts = (SmoothConditionNumber(self.p).value(sigma), SmoothSigmaMin(self.p).value(sigma))
        return float(np.logaddexp(*parts))

    def derivative(self, sigma: Array) -> Array:
        """Average of both derivatives, weighted by the share of each in the sum."""
        first, second = SmoothConditionNumber(self.p), SmoothSigmaMin(self.p)
        share = 1.0 / (1.0 + np.exp(second.value(sigma) - first.value(sigma)))
        return share * first.derivative(sigma) + (1.0 - share) * second.derivative(sigma)
