"""Smooth stand-in for log cond: (1/p) log Σ σ_i^p + (1/p) log Σ σ_i^−p.

It bounds log cond from above, by at most (2/p) log r, and is differentiable everywhere.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.base import Array, Criterion


@dataclass(frozen=True)
class SmoothConditionNumber(Criterion):
    """p-norm form; p → ∞ is the condition number."""

    p: float
    name = "smooth_condition_number"
    compares_columns = True

    @classmethod
    def build(cls, spec: CriterionSpec) -> Criterion:
        """With the `smoothing` of the config."""
        return cls(spec.smoothing)

    def value(self, sigma: Array) -> float:
        """Computed in logarithms, so that no power overflows."""
        if sigma[-1] <= 0:  # a parameter that does not show at all
            return float("inf")
        logs = np.log(sigma)
        sums = (high + np.log(np.exp(each - high).sum()) for each, high in self._powers(logs))
        return float(sum(sums)) / self.p

    def derivative(self, sigma: Array) -> Array:
        """(softmax(p log σ) − softmax(−p log σ)) / σ."""
        up, down = (np.exp(each - high) for each, high in self._powers(np.log(sigma)))
        return np.asarray((up / up.sum() - down / down.sum()) / sigma)

    def _powers(self, logs: Array) -> tuple[tuple[Array, float], tuple[Array, float]]:
        """Logarithms of σ^p and σ^−p, each with their greatest."""
        up, down = self.p * logs, -self.p * logs
        return (up, float(up.max())), (down, float(down.max()))

    def continuation(self) -> tuple[Criterion, ...]:
        """Rising p up to this one."""
        lower = tuple(SmoothConditionNumber(p) for p in (4.0, 16.0) if p < self.p)
        return (*lower, self)
