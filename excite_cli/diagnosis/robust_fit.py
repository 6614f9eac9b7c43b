"""The fit that is reported: weighted least squares in which outliers count less (Huber 1964).

What a search with quadratic costs has named is fitted once more with weights
min(1, c σ / |residual|) per sample, σ the joint's noise by its median absolute residual: transients
at reversals and blows do not pull friction and inertias.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.cholesky import Cholesky
from excite_cli.diagnosis.training import TrainingData
from excite_cli.robot.model import Array

_HUBER = 1.345
_ROUNDS = 8


def robust_solve(
    data: TrainingData, candidates: Sequence[Candidate], chosen: Sequence[int], levels: Array
) -> Array:
    """Parameters (k,) of the declared model and the chosen candidates."""
    blocks = [_rows(data, candidates, chosen, joint) for joint in range(data.n)]
    sigma = np.asarray(levels, dtype=float)
    weights = [np.ones(len(tau)) for _, tau in blocks]
    x = np.zeros(blocks[0][0].shape[1])
    for _ in range(_ROUNDS):
        x = _solve(data, blocks, weights, sigma)
        residuals = [tau - columns @ x for columns, tau in blocks]
        spread = [1.4826 * float(np.median(np.abs(r))) if len(r) else 0.0 for r in residuals]
        limits = [_HUBER * max(s, 1e-3 * level) for s, level in zip(spread, sigma, strict=True)]
        weights = [
            np.minimum(1.0, limit / np.maximum(np.abs(r), 1e-300))
            for r, limit in zip(residuals, limits, strict=True)
        ]
    return x


def _rows(
    data: TrainingData, candidates: Sequence[Candidate], chosen: Sequence[int], joint: int
) -> tuple[Array, Array]:
    """Columns (rows, k) and torque (rows,) of the usable samples of a joint."""
    columns, torques = [], []
    for part, run in enumerate(data.runs):
        usable = run.usable[:, joint]
        columns.append(data.columns(candidates, chosen, part, joint)[usable])
        torques.append(data.tau[part][usable, joint])
    return np.concatenate(columns), np.concatenate(torques)


def _solve(
    data: TrainingData, blocks: Sequence[tuple[Array, Array]], weights: list[Array], sigma: Array
) -> Array:
    size = blocks[0][0].shape[1]
    normal, rhs = np.zeros((size, size)), np.zeros(size)
    for (columns, tau), weight, s in zip(blocks, weights, sigma, strict=True):
        weighted = columns * (weight / s**2)[:, None]
        normal += weighted.T @ columns
        rhs += weighted.T @ tau
    if data.prior_precision is not None:
        at = np.arange(len(data.prior_precision))
        normal[at, at] += data.prior_precision
    scale = np.sqrt(np.diag(normal))
    scale[scale < 1e-100] = 1.0
    unit = normal / np.outer(scale, scale)
    unit[np.diag_indices(size)] += 1e-11
    return Cholesky(unit).solve(rhs / scale) / scale
