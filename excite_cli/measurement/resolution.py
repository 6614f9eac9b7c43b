"""Torques that come in steps: how large the steps are, and what they hide.

A torque that is rounded to multiples of a step is wrong by up to half of it, step/√12 on average.
While a joint moves through many steps that is noise; where the torque stays on one step the error
stays as well, and no filter takes it out. So the step is kept with the run, for standard deviations
(`identification.averages`), and told where it is more than a few per cent of the torque.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Run

_TOLD = 0.1  # RMS of the rounding, as a share of the torque's standard deviation
_OFF = 0.02  # share by which the smallest gap may miss a step; and how often that may add up
_MOST = 5
_REPEATED = 0.9  # more different values than this share of samples are no lattice
_ROUNDING = 1e-9  # of the span: differences of the arithmetic


def with_torque_steps(
    runs: Sequence[Run], joints: tuple[str, ...]
) -> tuple[list[Run], list[Finding]]:
    """The runs of a file with the steps (n,) of their torques, and one finding on coarse ones.

    `runs` are as recorded: interpolation would fill the steps.
    """
    steps = np.array(
        [
            lattice_step(np.concatenate([run.tau[run.usable()[:, j], j] for run in runs]))
            for j in range(len(joints))
        ]
    )
    if not steps.any():
        return list(runs), []
    spread = np.max([run.tau.std(axis=0) for run in runs], axis=0)
    share = np.divide(steps / np.sqrt(12), spread, out=np.zeros_like(steps), where=spread > 0)
    coarse = share > _TOLD
    kept = [replace(run, torque_step=steps) for run in runs]
    if not coarse.any():
        return kept, []
    told = [
        f"{joints[j]} of {steps[j]:.3g} ({share[j]:.0%} of its RMS torque)"
        for j in np.flatnonzero(coarse)
    ]
    text = (
        f"torques are quantised: steps on {', '.join(told)}. Standard deviations account for it; "
        "friction and offsets smaller than a step stay hidden. Record the torque with more digits, "
        "or exclude it: measurement.without_torque"
    )
    named = tuple(joints[j] for j in np.flatnonzero(coarse))
    where = ", ".join(run.name for run in runs)
    return kept, [Finding("torque_steps", "warning", text, where, named)]


def lattice_step(values: Array) -> float:
    """The step of which all `values` (T,) are multiples, beside a constant; 0 if there is none."""
    levels = np.unique(values)
    if not 1 < len(levels) < _REPEATED * len(values):
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > _ROUNDING * (levels[-1] - levels[0])]
    times = gaps / gaps.min()
    count = np.round(times)
    if (np.abs(times - count) > _OFF * np.clip(count, 1, _MOST)).any():
        return 0.0
    return float(gaps.sum() / count.sum())
