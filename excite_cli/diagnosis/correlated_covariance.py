"""Covariance of weighted least squares when the noise is serially correlated.

x̂ = A⁻¹ Xᵀ W y with A = Xᵀ W X, so cov = A⁻¹ (Xᵀ W Σ W X) A⁻¹. With an autoregression, Σ = H Hᵀ
where H filters white noise, and Xᵀ W Σ W X is the Gram matrix of Hᵀ W X: the columns filtered
backwards. Torques that are recorded in steps add what their rounding leaves uncertain.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import TrainingData
from excite_cli.out_of_core import forget
from excite_cli.robot.model import Array


def covariance_of(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    noise: NoiseModel,
    levels: Array,
) -> Array:
    """Covariance (k, k) of the parameters that the fit weighted by 1/levels gives."""
    size = data.declared[0].shape[2] + sum(candidates[i].width for i in chosen)
    normal, spread = np.zeros((size, size)), np.zeros((size, size))
    for joint in range(data.n):
        for part, run in enumerate(data.runs):
            columns = data.columns(candidates, chosen, part, joint)
            x = columns * run.usable[:, joint, None] / levels[joint] ** 2
            normal += (x * levels[joint] ** 2).T @ x
            taps = np.concatenate([[1.0], -noise.coefficients[joint]])
            filtered = lfilter([noise.sigma[joint]], taps, x[::-1], axis=0)
            spread += filtered.T @ filtered
            if run.rounding and (rounding := run.rounding[joint]) is not None:
                rounded = rounding.T @ x
                spread += rounded.T @ rounded
            forget()
    if data.prior is not None:
        fixed = len(data.prior) - 1
        normal[:fixed, :fixed] += data.prior[:-1, :-1]
        spread[:fixed, :fixed] += data.prior[:-1, :-1]
    scale = np.sqrt(np.diag(normal))
    scale[scale < 1e-100] = 1.0
    normal = normal / np.outer(scale, scale)
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True) / np.outer(scale, scale)
    return np.asarray(inverse @ spread @ inverse)
