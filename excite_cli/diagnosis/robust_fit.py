"""The fit that is reported: weighted least squares in which outliers count less (Huber 1964).

What a search with quadratic costs has named is fitted once more with weights
min(1, c σ / |residual|) per sample, σ the joint's noise by its median absolute residual: transients
at reversals and blows do not pull friction and inertias.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.cholesky import Cholesky
from excite_cli.diagnosis.training import TrainingData
from excite_cli.out_of_core import forget
from excite_cli.robot.model import Array

_HUBER = 1.345
_ROUNDS = 8


def robust_solve(
    data: TrainingData, candidates: Sequence[Candidate], chosen: Sequence[int], levels: Array
) -> Array:
    """Parameters (k,) of the declared model and the chosen candidates."""
    usable = [
        np.concatenate([run.usable[:, joint] for run in data.runs]) for joint in range(data.n)
    ]
    sigma = np.asarray(levels, dtype=float)
    weights = [np.ones(int(rows.sum())) for rows in usable]
    x = np.zeros(0)
    for _ in range(_ROUNDS):
        x = _solve(data, candidates, chosen, weights, sigma)
        left = np.concatenate(data.residuals(candidates, chosen, x))
        residuals = [left[rows, joint] for joint, rows in enumerate(usable)]
        spread = [1.4826 * float(np.median(np.abs(r))) if len(r) else 0.0 for r in residuals]
        limits = [_HUBER * max(s, 1e-3 * level) for s, level in zip(spread, sigma, strict=True)]
        weights = [
            np.minimum(1.0, limit / np.maximum(np.abs(r), 1e-300))
            for r, limit in zip(residuals, limits, strict=True)
        ]
    return x


def _rows(
    data: TrainingData, candidates: Sequence[Candidate], chosen: Sequence[int], joint: int
) -> Iterator[tuple[Array, Array]]:
    """Columns (rows, k) and torque (rows,) of the usable samples of a joint, part by part."""
    for part, run in enumerate(data.runs):
        usable = run.usable[:, joint]
        columns = data.columns(candidates, chosen, part, joint)[usable]
        yield columns, data.tau[part][usable, joint]
        forget()


def _solve(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    weights: list[Array],
    sigma: Array,
) -> Array:
    size = data.declared[0].shape[2] + sum(candidates[i].width for i in chosen)
    normal, rhs = np.zeros((size, size)), np.zeros(size)
    for joint, (own, s) in enumerate(zip(weights, sigma, strict=True)):
        done = 0
        for columns, tau in _rows(data, candidates, chosen, joint):
            weighted = columns * (own[done : done + len(tau)] / s**2)[:, None]
            normal += weighted.T @ columns
            rhs += weighted.T @ tau
            done += len(tau)
    if data.prior_precision is not None:
        at = np.arange(len(data.prior_precision))
        normal[at, at] += data.prior_precision
    scale = np.sqrt(np.diag(normal))
    scale[scale < 1e-100] = 1.0
    unit = normal / np.outer(scale, scale)
    unit[np.diag_indices(size)] += 1e-11
    return Cholesky(unit).solve(rhs / scale) / scale
