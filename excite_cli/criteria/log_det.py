"""D-optimality: −log det(CᵀC) / r = −(2/r) Σ log σ_i, the volume of the confidence ellipsoid."""

import numpy as np

from excite_cli.criteria.base import Array, Criterion


class LogDet(Criterion):
    """Mean of −2 log σ."""

    name = "log_det"

    def value(self, sigma: Array) -> float:
        """Divided by the rank, so that robots of different size compare."""
        return float(-2.0 * np.mean(np.log(sigma)))

    def derivative(self, sigma: Array) -> Array:
        """−2 / (r σ)."""
        return -2.0 / (len(sigma) * sigma)
