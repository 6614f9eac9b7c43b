"""The fit that is reported: weighted least squares in which outliers count less (Huber 1964).

What a search with quadratic costs has named is fitted once more with weights
min(1, c σ / |residual|) per sample, σ the joint's noise by its median absolute residual: transients
at reversals and blows do not pull friction and inertias.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.cholesky import RIDGE, Cholesky
from excite_cli.diagnosis.training import JointRows, TrainingData
from excite_cli.out_of_core import forget
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

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


def _solve(
    data: TrainingData,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    weights: list[Array],
    sigma: Array,
) -> Array:
    size = data.declared[0].shape[2] + sum(candidates[i].width for i in chosen)
    normal, rhs = np.zeros((size, size)), np.zeros(size)
    there = [candidates[i] for i in chosen]
    tasks = (
        (data.rows_of(there, joint), own / s**2)
        for joint, (own, s) in enumerate(zip(weights, sigma, strict=True))
    )
    for at, own, product in each(_weighted, None, tasks):
        normal[np.ix_(at, at)] += own
        rhs[at] += product
    if data.prior is not None:
        fixed = len(data.prior) - 1
        normal[:fixed, :fixed] += data.prior[:-1, :-1]
        rhs[:fixed] += data.prior[:-1, -1]
    scale = np.sqrt(np.diag(normal))
    scale[scale < 1e-100] = 1.0
    unit = normal / np.outer(scale, scale)
    unit[np.diag_indices(size)] += RIDGE
    return Cholesky(unit).solve(rhs / scale) / scale


def _weighted(
    shared: None, task: tuple[JointRows, Array], tell: Tell
) -> tuple[NDArray[np.intp], Array, Array]:
    """Which columns show in a joint's rows, and their weighted products (A, A) and (A,)."""
    rows, weights = task
    size, done = len(rows.active), 0
    normal, rhs = np.zeros((size, size)), np.zeros(size)
    for blocks, usable in zip(rows.blocks, rows.usable, strict=True):
        x = np.concatenate(blocks, axis=1)[usable]
        columns = x[:, :-1]
        weighted = columns * weights[done : done + len(x), None]
        normal += weighted.T @ columns
        rhs += weighted.T @ x[:, -1]
        done += len(x)
        forget()
    return rows.active, normal, rhs
