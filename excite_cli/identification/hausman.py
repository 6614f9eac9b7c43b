"""Is least squares biased by closed-loop control or noisy positions? (Durbin, Wu, Hausman)

Noise of the torque that the controller feeds back into the motion, or noise of the encoders,
correlates the columns C with the errors. Columns Z made of the *reference* motion, or of other
periods of the same motion, carry the same signal but not that noise. What Z does not explain of C,
V = C − Z Π, is added to the regression: if C is free of the noise its coefficients are zero. They
are tested with a covariance that respects serial correlation. (Hausman 1978; for robots Janot,
Vandanjon & Gautier 2013, Brunot et al. 2018.) The instrumental-variable estimate is x of the
regression on Z Π.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.special import fdtrc

from excite_cli.identification.covariance import Rows, estimate_covariance
from excite_cli.identification.factors import run_factors, solve, stacked, together
from excite_cli.identification.least_squares import factors_of, fit_rows
from excite_cli.identification.periods import mean_of_other_periods, period_of
from excite_cli.measurement.dataset import Dataset, Mask, Run
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Function, Tell

Source = Literal["reference", "periods", "none"]
REFERENCE = "q_ref"
# Directions of V below this share of C's size are rounding.
_DUST = 1e-7
SIGNIFICANT = 0.01
_ALIGNMENTS = 8


@dataclass(frozen=True)
class Hausman:
    """`p_value` that the columns are free of the noise; NaN if not `testable`, for `reason`.

    `bias` (p,): estimate less instrumental-variable estimate, `bias_std` its standard deviation.
    """

    testable: bool
    reason: str
    source: Source = "none"
    statistic: float = float("nan")
    degrees: int = 0
    p_value: float = float("nan")
    bias: Array | None = None
    bias_std: Array | None = None

    def sentence(self) -> str:
        """For people."""
        if not self.testable:
            return f"closed-loop bias: not testable, {self.reason}"
        origin = {"reference": "the reference motion", "periods": "repeated periods"}[self.source]
        figures = (
            f"Durbin-Wu-Hausman with {origin}, F = {self.statistic:.3g} with {self.degrees} "
            f"degrees of freedom, p = {self.p_value:.2g}"
        )
        if self.p_value >= SIGNIFICANT:
            return f"closed-loop bias: not found ({figures})"
        return (
            f"closed-loop bias: the residual is correlated with the robot's deviation from "
            f"{origin} ({figures}); the controller feeds noise back, or the model lacks something"
        )


def instrument_dataset(dataset: Dataset) -> tuple[Dataset | None, Source, str]:
    """The dataset with positions free of this recording's noise, where they come from, or why not.

    Reference positions (`extra['q_ref']`, (T, n)) if every run has them, each joint's shifted in
    time by its mean lag; else for each sample the mean of the other periods of a periodic motion.
    """
    if all(
        REFERENCE in run.extra and run.extra[REFERENCE].shape == run.q.shape for run in dataset.runs
    ):
        moved = each(_aligned, None, dataset.runs)
        return replace(dataset, runs=_moving_as(dataset.runs, moved)), "reference", ""
    positions = [run.q for run in dataset.runs]
    periods = list(each(_period, None, positions))
    if all(period is not None for period in periods):
        moved = each(_other_periods, None, list(zip(positions, periods, strict=True)))
        return replace(dataset, runs=_moving_as(dataset.runs, moved)), "periods", ""
    return None, "none", (
        "there is neither a reference motion (channel q_ref) nor a motion of two or more periods"
    )  # fmt: skip


def _moving_as(runs: Sequence[Run], motions: Iterable[Array]) -> tuple[Run, ...]:
    """The runs with other positions."""
    spool = Spool()
    pairs = zip(runs, motions, strict=True)
    return tuple(replace(run, q=spool.keep(q), dq=None) for run, q in pairs)


def _period(shared: None, q: Array, tell: Tell) -> int | None:
    return period_of(q)


def _other_periods(shared: None, task: tuple[Array, int], tell: Tell) -> Array:
    return mean_of_other_periods(*task)


def _aligned(shared: None, run: Run, tell: Tell) -> Array:
    """Reference positions, shifted in time so that they lie best on the recorded ones."""
    reference, speed = run.extra[REFERENCE], np.gradient(run.q, run.step, axis=0)
    lead, shifted = np.zeros(run.q.shape[1]), reference
    energy = np.maximum(np.square(speed).sum(axis=0), 1e-300)
    for _ in range(_ALIGNMENTS):
        lead = lead + ((run.q - shifted) * speed).sum(axis=0) / energy
        shifted = np.column_stack(
            [np.interp(run.t + lead[j], run.t, reference[:, j]) for j in range(len(lead))]
        )
    return shifted


def not_testable(reason: str) -> Hausman:
    """The verdict when there are no instruments."""
    return Hausman(False, reason)


def hausman_test(
    runs: Sequence[Rows], instruments: Sequence[Array], source: Source, noise: Array
) -> Hausman:
    """Test columns of `runs` against instrument columns, per run (M, n, p); `noise` (n,) [N·m]."""
    p = runs[0].columns.shape[2]
    triangle = _triangle(runs, instruments, noise)
    z, c = triangle[:, :p], triangle[:, p:]
    first_stage = np.linalg.lstsq(z / _norms(z), c, rcond=1e-10)[0] / _norms(z)[:, None]
    values, directions = np.linalg.svd((c - z @ first_stage) / _norms(c))[1:]
    kept = values > _DUST * np.sqrt(p)
    if not kept.any():
        return not_testable("the instruments repeat the columns without any noise")
    turn = directions[kept].T / values[kept] / _norms(c)[:, None]  # V turn: orthonormal columns
    turn *= np.sqrt(sum(int(run.usable.sum()) for run in runs))
    fitted = fit_rows(_with(_augmented, (first_stage, turn), runs, instruments), "wls")
    extra = int(kept.sum())
    if not fitted.seen[p:].all():
        return not_testable("the parts of the columns that the instruments miss are not separate")
    gamma, covariance = fitted.x[p:], fitted.covariance[p:, p:]
    statistic = float(gamma @ np.linalg.solve(covariance, gamma)) / extra
    freedom = max(fitted.samples - 2 * p, 4.0)
    bias, bias_std = _bias(runs, instruments, first_stage, noise)
    return Hausman(
        testable=True,
        reason="",
        source=source,
        statistic=statistic,
        degrees=extra,
        p_value=float(fdtrc(extra, freedom, statistic)),
        bias=bias,
        bias_std=bias_std,
    )


def _with(
    columns: Function, shared: Any, runs: Sequence[Rows], instruments: Sequence[Array]
) -> list[Rows]:
    """The runs with the columns that are made of theirs and of the instruments."""
    spool = Spool()
    tasks = [(run.columns, own) for run, own in zip(runs, instruments, strict=True)]
    made = each(columns, shared, tasks)
    return [Rows(spool.keep(own), run.tau, run.usable) for run, own in zip(runs, made, strict=True)]


def _augmented(shared: tuple[Array, Array], task: tuple[Array, Array], tell: Tell) -> Array:
    """Columns, and what the instruments miss of them."""
    (first_stage, turn), (columns, instrument) = shared, task
    return np.concatenate([columns, (columns - instrument @ first_stage) @ turn], axis=2)


def _projected(first_stage: Array, task: tuple[Array, Array], tell: Tell) -> Array:
    """What the instruments tell of the columns."""
    return np.asarray(task[1] @ first_stage)


def _triangle(runs: Sequence[Rows], instruments: Sequence[Array], noise: Array) -> Array:
    """R (·, 2p) of the usable rows [Z C] of all runs, divided by `noise`."""
    pairs = zip(runs, instruments, strict=True)
    tasks = [(instrument, run.columns, run.usable) for run, instrument in pairs]
    return stacked(together(each(_factors_of_both, None, tasks)), noise)[:, :-1]


def _factors_of_both(shared: None, task: tuple[Array, Array, Mask], tell: Tell) -> Array:
    instrument, columns, usable = task
    both = np.concatenate([instrument, columns], axis=2)
    return run_factors(both, np.zeros(usable.shape), usable)


def _norms(x: Array) -> Array:
    norms = np.linalg.norm(x, axis=0)
    return np.where(norms > 0, norms, 1.0)


def _bias(
    runs: Sequence[Rows], instruments: Sequence[Array], first_stage: Array, noise: Array
) -> tuple[Array, Array]:
    """Least squares less instrumental variables (p,), and the latter's standard deviation.

    NaN where rounding leaves no variance: the instruments do not show that parameter.
    """
    projected = _with(_projected, first_stage, runs, instruments)
    plain, second = (solve(stacked(factors_of(group), noise)) for group in (runs, projected))
    covariance = estimate_covariance(projected, second.x, second.inverse, noise)
    variance = np.diag(covariance.matrix)
    return plain.x - second.x, np.sqrt(np.where(variance > 0.0, variance, np.nan))
