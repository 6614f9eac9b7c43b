"""Least squares over runs: τ = C x + e, by `ols`, `wls` or `irls`, with a prior or without.

`ols` weights all joints alike, `wls` by the noise of each joint (Gautier 1997). `irls` further
lowers the weight of outliers (Huber 1964): a residual r beyond 1.345 of a robust scale, 1.4826
times the median absolute deviation, counts by 1.345/|r| of its square. The fit works on triangular
factors per run and joint (`factors`); its covariance respects that noise is serially correlated
(`covariance`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from excite_cli.identification.covariance import RunRows, estimate_covariance
from excite_cli.identification.factors import (
    Mask,
    Solution,
    residual_squares,
    run_factors,
    solve,
    stacked,
    together,
)
from excite_cli.out_of_core import Spool, forget
from excite_cli.robot.model import Array
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

Method = Literal["ols", "wls", "irls"]
_ROUNDS, _SETTLED = 30, 1e-6
# Residuals and columns below this share of the torque are rounding.
EXACT = 1e-9
# Share of the torque that is taken for noise at first: below that of any robot, so that what a
# prior forbids is not taken for noise before the data were heard (then the alternation stays there:
# a rotor of 1 kg·m² that inertias took up was left in the residual, 2.5 % of error for 0.26).
AT_FIRST = 1e-3
_HUBER, _MAD = 1.345, 1.4826  # 95 % efficient where noise is normal


@dataclass(frozen=True)
class LinearFit:
    """x (p,) with its covariance (p, p); `seen` (p,) identifiable at all; `noise` (n,) [N·m].

    `shown` (p, p): covariance along the directions that the data show, finite for all. `factor`
    (p+1, p+1) of the rows divided by `noise`, without the prior; `count` (n,) usable rows;
    `samples` effective number of independent ones.
    """

    x: Array
    covariance: Array
    shown: Array
    seen: Mask
    noise: Array
    factor: Array
    count: Array
    samples: float


def fit_rows(
    runs: Sequence[RunRows],
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
    p = factors[0].shape[-1] - 1
    count = sum((run.usable.sum(axis=0) for run in runs), np.zeros(runs[0].tau.shape[1], int))
    size = _rms(factors, np.zeros(p), count)
    floor = EXACT * np.where(size > 0, size, 1.0)
    extra = np.zeros((0, p + 1)) if prior is None else np.column_stack(prior)
    sigma, solution = _by_noise(factors, count, floor, extra, method)
    bread = solution.inverse
    if method == "irls":
        runs, sigma, solution = _reweighted(runs, solution, floor, extra)
        factors = factors_of(runs)
        bread = _curvature(runs, solution.x, sigma, extra)
    matrix, samples = estimate_covariance(runs, solution.x, bread, sigma)
    of_prior = bread @ extra[:, :-1].T  # its rows are independent and of unit variance
    matrix = matrix + of_prior @ of_prior.T
    noise = np.maximum(_rms(factors, solution.x, count), floor)
    covariance = np.where(np.outer(solution.seen, solution.seen), matrix, 0.0)
    covariance[~solution.seen, ~solution.seen] = np.inf
    return LinearFit(
        x=solution.x,
        covariance=covariance,
        shown=matrix,
        seen=solution.seen,
        noise=noise,
        factor=stacked(factors, noise),
        count=count,
        samples=samples,
    )


def factors_of(runs: Sequence[RunRows]) -> list[Array]:
    """Factors (n, p+1, p+1) of runs, `together`."""
    tasks = [(run.columns, run.tau, run.usable, run.weights) for run in runs]
    return together(each(_factors, None, tasks))


def _factors(shared: None, task: tuple[Array, Array, Mask, Array | None], tell: Tell) -> Array:
    return run_factors(*task)


def _without_dust(runs: Sequence[RunRows], sizes: Array) -> Sequence[RunRows]:
    columns = np.zeros_like(sizes)
    for run in runs:
        columns = np.maximum(columns, np.abs(run.columns).max(axis=(0, 1), initial=0.0))
        forget()
    torque = max(float(np.abs(run.tau[run.usable]).max(initial=0.0)) for run in runs)
    dust = columns * sizes <= EXACT * torque
    if not dust.any():
        return runs
    spool, found = Spool(), []
    for run in runs:
        found.append(replace(run, columns=spool.keep(run.columns * ~dust)))
        forget()
    return found


def _rms(factors: Sequence[Array], x: Array, count: Array) -> Array:
    """RMS (n,) per joint of what x leaves of the torque, of so many rows."""
    return np.sqrt(residual_squares(factors, x) / np.maximum(count, 1))


def _by_noise(
    factors: Sequence[Array], count: Array, floor: Array, extra: Array, method: Method
) -> tuple[Array, Solution]:
    """Alternate between x and the noise of every joint until it settles."""
    p, total = factors[0].shape[-1] - 1, int(count.sum())
    freedom = np.maximum(count - p * count / max(total, 1), 1.0)  # less its share of parameters
    sigma = AT_FIRST / EXACT * floor
    if method == "ols":  # all joints alike
        sigma = np.full_like(sigma, sigma.max())
    solution = solve(stacked(factors, sigma, extra[:0] if method == "ols" else extra))
    if method == "ols" and not len(extra):
        return sigma, solution
    for _ in range(_ROUNDS):
        squares = residual_squares(factors, solution.x)
        found = np.maximum(np.sqrt(squares / freedom), floor)
        if method == "ols":  # one noise for all joints, to weigh the prior against
            found = np.full_like(found, np.sqrt(squares.sum() / max(total - p, 1)))
        settled = np.abs(found - sigma).max() <= _SETTLED * found.max()
        sigma, solution = found, solve(stacked(factors, found, extra))
        if settled:
            break
    return sigma, solution


def _reweighted(
    runs: Sequence[RunRows], solution: Solution, floor: Array, extra: Array
) -> tuple[Sequence[RunRows], Array, Solution]:
    """The runs with Huber's weights, the scale (n,) that they are made of, and their fit."""
    sigma = floor
    for _ in range(_ROUNDS):
        residuals = [run.residual(solution.x) for run in runs]
        sigma = np.maximum(_robust_scale(runs, residuals), floor)
        runs = [
            replace(run, weights=_HUBER / np.maximum(np.abs(residual) / sigma, _HUBER))
            for run, residual in zip(runs, residuals, strict=True)
        ]
        before, solution = solution.x, solve(stacked(factors_of(runs), sigma, extra))
        step = np.abs(solution.x - before) / np.sqrt(np.maximum(np.diag(solution.inverse), 1e-300))
        if step[solution.seen].max(initial=0.0) < 1e-4:
            break
    return runs, sigma, solution


def _robust_scale(runs: Sequence[RunRows], residuals: Sequence[Array]) -> Array:
    """Robust standard deviation (n,) of the usable residuals; 0 where there are none."""
    size, usable = np.abs(np.concatenate(residuals)), np.concatenate([run.usable for run in runs])
    return np.array([
        _MAD * float(np.median(size[good, j])) if good.any() else 0.0
        for j, good in enumerate(usable.T)
    ])  # fmt: skip


def _curvature(runs: Sequence[RunRows], x: Array, sigma: Array, extra: Array) -> Array:
    """Inverse of Σ c cᵀ/σ² over the rows that count in full."""
    inner = [
        replace(run, weights=None, usable=run.usable & (np.abs(run.residual(x)) <= _HUBER * sigma))
        for run in runs
    ]
    return solve(stacked(factors_of(inner), sigma, extra)).inverse
