"""E-optimality: −log σ_min, the least visible direction."""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, softmax

from excite_cli.criteria.base import SHARPNESS, Array, Criterion


class SigmaMin(Criterion):
    """−log σ_min; not differentiable where the smallest singular values meet."""

    name = "sigma_min"

    def value(self, sigma: Array) -> float:
        """−log σ_min."""
        return float(-np.log(sigma[-1]))

    def derivative(self, sigma: Array) -> Array:
        """−1/σ_min at the smallest."""
        derivative = np.zeros_like(sigma)
        derivative[-1] = -1.0 / sigma[-1]
        return derivative

    def continuation(self) -> tuple[Criterion, ...]:
        """Smooth forms with rising p: the smallest singular values meet at good optima."""
        return tuple(SmoothSigmaMin(p) for p in SHARPNESS)


@dataclass(frozen=True)
class SmoothSigmaMin(Criterion):
    """(1/p) log Σ σ_i^−p, an upper bound of −log σ_min."""

    p: float
    name = "smooth_sigma_min"

    def value(self, sigma: Array) -> float:
        """Computed in logarithms."""
        return float(logsumexp(-self.p * np.log(sigma)) / self.p)

    def derivative(self, sigma: Array) -> Array:
        """−softmax(−p log σ) / σ."""
        return -softmax(-self.p * np.log(sigma)) / sigma
