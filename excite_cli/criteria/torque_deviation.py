"""I-optimality (V-optimality): the standard deviation of predicted torques.

Over random states within the limits, for noise of one: ½ log Σ σ_k⁻², of singular values of columns
that are combined so that this is the mean variance (`excitation/weighting.py`). It does not
depend on which columns are called base parameters.
"""

import numpy as np
from scipy.special import logsumexp, softmax

from excite_cli.criteria.base import Array, Criterion


class TorqueDeviation(Criterion):
    """Logarithm of the RMS standard deviation of a predicted torque."""

    name = "torque_deviation"
    of_torques = True

    def value(self, sigma: Array) -> float:
        """½ log Σ σ⁻²."""
        return float(0.5 * logsumexp(-2.0 * np.log(sigma)))

    def derivative(self, sigma: Array) -> Array:
        """−softmax(−2 log σ) / σ."""
        return -softmax(-2.0 * np.log(sigma)) / sigma
