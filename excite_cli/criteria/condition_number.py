"""The paper's criterion, Eq. 5, minimised as its logarithm: log σ_max − log σ_min."""

import numpy as np

from excite_cli.criteria.base import SHARPNESS, Array, Criterion
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber


class ConditionNumber(Criterion):
    """log cond; not differentiable where the extreme singular values meet."""

    name = "condition_number"
    compares_columns = True

    def value(self, sigma: Array) -> float:
        """Log σ_max − log σ_min."""
        return float(np.log(sigma[0]) - np.log(sigma[-1]))

    def derivative(self, sigma: Array) -> Array:
        """1/σ_max at the largest, −1/σ_min at the smallest (Eq. 17 divided by the value)."""
        derivative = np.zeros_like(sigma)
        derivative[0] += 1.0 / sigma[0]
        derivative[-1] -= 1.0 / sigma[-1]
        return derivative

    def continuation(self) -> tuple[Criterion, ...]:
        """Smooth forms with rising p: extreme singular values meet at good optima."""
        return tuple(SmoothConditionNumber(p) for p in SHARPNESS)
