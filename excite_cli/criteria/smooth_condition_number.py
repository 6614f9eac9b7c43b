"""Smooth stand-in for log cond: (1/p) log Σ σ_i^p + (1/p) log Σ σ_i^−p.

It bounds log cond from above, by at most (2/p) log r, and is differentiable everywhere.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, softmax

from excite_cli.criteria.base import Array, Criterion


@dataclass(frozen=True)
class SmoothConditionNumber(Criterion):
    """p-norm form; p → ∞ is the condition number."""

    p: float
    name = "smooth_condition_number"

    def value(self, sigma: Array) -> float:
        """Computed in logarithms, so that no power overflows."""
        logs = np.log(sigma)
        return float((logsumexp(self.p * logs) + logsumexp(-self.p * logs)) / self.p)

    def derivative(self, sigma: Array) -> Array:
        """(softmax(p log σ) − softmax(−p log σ)) / σ."""
        logs = np.log(sigma)
        return (softmax(self.p * logs) - softmax(-self.p * logs)) / sigma

    def continuation(self) -> tuple[Criterion, ...]:
        """Rising p up to this one."""
        lower = tuple(SmoothConditionNumber(p) for p in (4.0, 16.0) if p < self.p)
        return (*lower, self)
