"""Least squares over runs: τ = C x + e, by `ols`, `wls` or `irls`, with a prior or without.

`ols` weights all joints alike, `wls` by the noise of each joint (Gautier 1997), `irls` further
lowers the weight of outliers. The fit works on triangular factors per run and joint (`factors`);
its covariance respects that noise is serially correlated (`covariance`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from excite_cli.identification.covariance import Covariance, Rows, estimate_covariance
from excite_cli.identification.factors import (
    Mask,
    Solution,
    residual_squares,
    run_factors,
    solve,
    stacked,
    together,
)
from excite_cli.identification.robust import huber_weights, robust_scale, within
from excite_cli.out_of_core import Spool, forget
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

Method = Literal["ols", "wls", "irls"]
_ROUNDS, _SETTLED = 30, 1e-6
# Residuals below this share of the torque are rounding, not noise.
_EXACT = 1e-9


@dataclass(frozen=True)
class LinearFit:
    """x (p,) with its covariance (p, p); `seen` (p,) identifiable at all; `noise` (n,) [N·m].

    `factor` (p+1, p+1) of the rows divided by `noise`, without the prior; `count` (n,) usable
    rows; `samples` effective number of independent ones; `weights` per run for robust fits.
    """

    x: Array
    covariance: Array
    seen: Mask
    noise: Array
    factor: Array
    count: Array
    samples: float
    weights: tuple[Array, ...] | None = None


def fit_rows(
    runs: Sequence[Rows],
    method: Method = "wls",
    prior: tuple[Array, Array] | None = None,
    sizes: Array | None = None,
) -> LinearFit:
    """Fit all columns of `runs`; `prior` = (A, b) adds ‖A x − b‖² in units of standard deviations.

    `sizes` (p,): how large the parameters usually are. A column that at such a size gives less
    than a billionth of the torque is rounding (sgn v of a joint that stands still) and left out.
    Unusable rows do not count. Parameters that the data do not show, alone or against each other,
    share the least values that fit, with infinite variance and `seen` false.
    """
    if sizes is not None:
        runs = _without_dust(runs, sizes)
    factors = factors_of(runs)
    n = runs[0].tau.shape[1]
    count = sum((run.usable.sum(axis=0) for run in runs), np.zeros(n, int))
    floor = _EXACT * _torque_size(factors, count)
    extra = None if prior is None else np.column_stack(prior)
    sigma, solution = _by_noise(factors, count, floor, extra, method)
    weights = None
    if method == "irls":
        weights, sigma, solution = _reweighted(runs, solution, floor, extra)
        factors = factors_of(runs, weights=weights)
    found = _covariance(runs, weights, solution, sigma, extra)
    noise = np.sqrt(residual_squares(factors, solution.x) / np.maximum(count, 1))
    noise = np.maximum(noise, floor)
    covariance = np.where(np.outer(solution.seen, solution.seen), found.matrix, 0.0)
    covariance[~solution.seen, ~solution.seen] = np.inf
    return LinearFit(
        x=solution.x,
        covariance=covariance,
        seen=solution.seen,
        noise=noise,
        factor=stacked(factors, noise),
        count=count,
        samples=found.samples,
        weights=weights,
    )


def factors_of(
    runs: Sequence[Rows], usable: Sequence[Mask] | None = None, weights: Sequence[Array] = ()
) -> list[Array]:
    """Factors (n, p+1, p+1) of runs, `together`; with other `usable` rows or `weights` if given."""
    tasks = [
        (
            run.columns,
            run.tau,
            run.usable if usable is None else usable[k],
            weights[k] if weights else None,
        )
        for k, run in enumerate(runs)
    ]
    return together(each(_factors, None, tasks))


def _factors(shared: None, task: tuple[Array, Array, Mask, Array | None], tell: Tell) -> Array:
    return run_factors(*task)


def _without_dust(runs: Sequence[Rows], sizes: Array) -> Sequence[Rows]:
    columns = np.zeros_like(sizes)
    for run in runs:
        columns = np.maximum(columns, np.abs(run.columns).max(axis=(0, 1), initial=0.0))
        forget()
    torque = max(float(np.abs(run.tau[run.usable]).max(initial=0.0)) for run in runs)
    dust = columns * sizes <= _EXACT * torque
    if not dust.any():
        return runs
    spool, found = Spool(), []
    for run in runs:
        found.append(replace(run, columns=spool.keep(run.columns * ~dust)))
        forget()
    return found


def _covariance(
    runs: Sequence[Rows],
    weights: Sequence[Array] | None,
    solution: Solution,
    sigma: Array,
    extra: Array | None,
) -> Covariance:
    """Of x, with the share of the prior: its rows are independent and of unit variance."""
    bread = solution.inverse
    if weights is not None:
        bread = _curvature(runs, solution.x, sigma, extra)
        runs = [replace(run, weights=weight) for run, weight in zip(runs, weights, strict=True)]
    found = estimate_covariance(runs, solution.x, bread, sigma)
    if extra is None:
        return found
    rows = bread @ extra[:, :-1].T
    return Covariance(found.matrix + rows @ rows.T, found.noises, found.samples)


def _torque_size(factors: Sequence[Array], count: Array) -> Array:
    squares = residual_squares(factors, np.zeros(factors[0].shape[-1] - 1))
    size = np.sqrt(squares / np.maximum(count, 1))
    return np.where(size > 0, size, 1.0)


def _freedom(count: Array, p: int) -> Array:
    """Rows per joint less its share of the parameters."""
    return np.maximum(count - p * count / max(int(count.sum()), 1), 1.0)


def _by_noise(
    factors: Sequence[Array], count: Array, floor: Array, extra: Array | None, method: Method
) -> tuple[Array, Solution]:
    """Alternate between x and the noise of every joint until it settles."""
    p = factors[0].shape[-1] - 1
    sigma = np.ones(len(count))
    solution = solve(stacked(factors, sigma, None if method == "ols" else extra))
    if method == "ols" and extra is None:
        return sigma, solution
    for _ in range(_ROUNDS):
        squares = residual_squares(factors, solution.x)
        found = np.maximum(np.sqrt(squares / _freedom(count, p)), floor)
        if method == "ols":  # one noise for all joints, to weigh the prior against
            found = np.full_like(found, np.sqrt(squares.sum() / max(int(count.sum()) - p, 1)))
        settled = np.abs(found - sigma).max() <= _SETTLED * found.max()
        sigma, solution = found, solve(stacked(factors, found, extra))
        if settled:
            break
    return sigma, solution


def _reweighted(
    runs: Sequence[Rows], solution: Solution, floor: Array, extra: Array | None
) -> tuple[tuple[Array, ...], Array, Solution]:
    usable = [run.usable for run in runs]
    weights: tuple[Array, ...] = ()
    sigma = floor
    for _ in range(_ROUNDS):
        residuals = [run.residual(solution.x) for run in runs]
        sigma = np.maximum(robust_scale(residuals, usable), floor)
        weights = tuple(huber_weights(residual, sigma) for residual in residuals)
        factors = factors_of(runs, weights=weights)
        before, solution = solution.x, solve(stacked(factors, sigma, extra))
        step = np.abs(solution.x - before) / np.sqrt(np.maximum(np.diag(solution.inverse), 1e-300))
        if step[solution.seen].max(initial=0.0) < 1e-4:
            break
    return weights, sigma, solution


def _curvature(runs: Sequence[Rows], x: Array, sigma: Array, extra: Array | None) -> Array:
    """Inverse of Σ c cᵀ/σ² over the rows that count in full."""
    inner = [run.usable & within(run.residual(x), sigma) for run in runs]
    return solve(stacked(factors_of(runs, inner), sigma, extra)).inverse
