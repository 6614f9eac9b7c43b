"""A-optimality: log trace((CᵀC)⁻¹) = log Σ σ_i⁻², the summed variance of the parameters."""

import numpy as np
from scipy.special import logsumexp, softmax

from excite_cli.criteria.base import Array, Criterion


class TraceInverse(Criterion):
    """Logarithm of the summed parameter variance at unit torque noise."""

    name = "trace_inverse"

    def value(self, sigma: Array) -> float:
        """Log Σ σ⁻²."""
        return float(logsumexp(-2.0 * np.log(sigma)))

    def derivative(self, sigma: Array) -> Array:
        """−2 softmax(−2 log σ) / σ."""
        return -2.0 * softmax(-2.0 * np.log(sigma)) / sigma
