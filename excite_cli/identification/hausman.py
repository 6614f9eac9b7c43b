"""Is least squares biased by closed-loop control or noisy positions? (Durbin, Wu, Hausman)

Noise of the torque that the controller feeds back into the motion, or noise of the encoders,
correlates the columns C with the errors. Columns Z made of the *reference* motion, or of other
periods of the same motion, carry the same signal but not that noise. What Z does not explain of C,
V = C − Z Π, is added to the regression: if C is free of the noise its coefficients are zero. They
are tested with a covariance that respects serial correlation. (Hausman 1978; for robots Janot,
Vandanjon & Gautier 2013, Brunot et al. 2018.)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import fdtrc

from excite_cli.identification.covariance import RunRows
from excite_cli.identification.factors import run_factors, stacked, together
from excite_cli.identification.least_squares import fit_rows
from excite_cli.identification.noise_floor import exact_period
from excite_cli.measurement.dataset import Dataset, Mask, Run
from excite_cli.out_of_core import Spool
from excite_cli.robot.model import Array
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

Source = Literal["reference", "periods", "none"]
REFERENCE = "q_ref"
# Directions of V below this share of C's size are rounding.
_DUST = 1e-7
SIGNIFICANT = 0.01
_ALIGNMENTS = 8


@dataclass(frozen=True)
class Hausman:
    """`p_value` that the columns are free of the noise; NaN if not `testable`, for `reason`."""

    testable: bool
    reason: str
    source: Source = "none"
    statistic: float = float("nan")
    degrees: int = 0
    p_value: float = float("nan")

    def sentence(self) -> str:
        """For people."""
        if not self.testable:
            return f"closed-loop bias: not testable, {self.reason}"
        origin = {"reference": "the reference motion", "periods": "repeated periods"}[self.source]
        figures = (
            f"Durbin-Wu-Hausman test, {origin} as instrument: p = {self.p_value:.2g}, F = "
            f"{self.statistic:.3g} with {self.degrees} numerator degrees of freedom"
        )
        if self.p_value >= SIGNIFICANT:
            return f"closed-loop bias: none detected ({figures})"
        return (
            f"closed-loop bias: the residual is correlated with the robot's deviation from "
            f"{origin} ({figures}); the controller feeds noise back, or the model lacks something"
        )


def instrument_dataset(dataset: Dataset) -> tuple[Dataset | None, Source, str]:
    """The dataset with positions free of this recording's noise, where they come from, or why not.

    Reference positions (`extra['q_ref']`, (T, n)) if every run has them, each joint's shifted in
    time by its mean lag; else for each sample the mean of the other periods of a periodic motion.
    """
    runs = dataset.runs
    if all(REFERENCE in run.extra and run.extra[REFERENCE].shape == run.q.shape for run in runs):
        source: Source = "reference"
        motions = each(_aligned, None, runs)
    else:
        periods = list(each(_period, None, [run.q for run in runs]))
        if None in periods:
            return None, "none", (
                "there is neither a reference motion (channel q_ref) nor a motion of two or more "
                "periods"
            )  # fmt: skip
        source = "periods"
        motions = each(
            _other_periods, None, [(run.q, p) for run, p in zip(runs, periods, strict=True)]
        )
    spool = Spool()
    moved = [replace(run, q=spool.keep(q), dq=None) for run, q in zip(runs, motions, strict=True)]
    return replace(dataset, runs=tuple(moved)), source, ""


def _period(shared: None, q: Array, tell: Tell) -> int | None:
    found = exact_period(q, np.ones(len(q), dtype=bool))
    return None if found is None else round(found)


def _other_periods(shared: None, task: tuple[Array, int], tell: Tell) -> Array:
    """For every sample of x (T, n) the mean of the samples whole periods away from it."""
    x, period = task
    phase = np.arange(len(x)) % period
    total = np.zeros((period, x.shape[1]))
    np.add.at(total, phase, x)
    others = np.bincount(phase) - 1
    return np.asarray((total[phase] - x) / np.maximum(others, 1)[phase, None])


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


def hausman_test(
    runs: Sequence[RunRows], instruments: Sequence[Array], source: Source, noise: Array
) -> Hausman:
    """Test columns of `runs` against instrument columns, per run (M, n, p); `noise` (n,) [N·m]."""
    p = runs[0].columns.shape[2]
    tasks = [(own, run.columns, run.usable) for run, own in zip(runs, instruments, strict=True)]
    triangle = stacked(together(each(_factors_of_both, None, tasks)), noise)[:, :-1]
    z, c = triangle[:, :p], triangle[:, p:]
    first_stage = np.linalg.lstsq(z / _norms(z), c, rcond=1e-10)[0] / _norms(z)[:, None]
    values, directions = np.linalg.svd((c - z @ first_stage) / _norms(c))[1:]
    kept = values > _DUST * np.sqrt(p)
    if not kept.any():
        return Hausman(False, "the instruments repeat the columns without any noise")
    turn = directions[kept].T / values[kept] / _norms(c)[:, None]  # V turn: orthonormal columns
    turn *= np.sqrt(sum(int(run.usable.sum()) for run in runs))
    spool = Spool()
    augmented = each(_augmented, (first_stage, turn), tasks)
    fitted = fit_rows([
        RunRows(spool.keep(columns), run.tau, run.usable)
        for run, columns in zip(runs, augmented, strict=True)
    ])  # fmt: skip
    if not fitted.seen[p:].all():
        return Hausman(False, "the parts of the columns that the instruments miss are not separate")
    extra = int(kept.sum())
    gamma, covariance = fitted.x[p:], fitted.covariance[p:, p:]
    statistic = float(gamma @ np.linalg.solve(covariance, gamma)) / extra
    freedom = max(fitted.samples - 2 * p, 4.0)
    p_value = float(fdtrc(extra, freedom, statistic))
    return Hausman(True, "", source, statistic, extra, p_value)


def _augmented(shared: tuple[Array, Array], task: tuple[Array, Array, Mask], tell: Tell) -> Array:
    """Columns, and what the instruments miss of them."""
    (first_stage, turn), (instrument, columns, _) = shared, task
    return np.concatenate([columns, (columns - instrument @ first_stage) @ turn], axis=2)


def _factors_of_both(shared: None, task: tuple[Array, Array, Mask], tell: Tell) -> Array:
    """R (n, ·, 2p + 1) of the usable rows [Z C 0]."""
    instrument, columns, usable = task
    both = np.concatenate([instrument, columns], axis=2)
    return run_factors(both, np.zeros(usable.shape), usable)


def _norms(x: Array) -> Array:
    norms = np.linalg.norm(x, axis=0)
    return np.where(norms > 0, norms, 1.0)
