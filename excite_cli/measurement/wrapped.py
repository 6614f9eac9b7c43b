"""Positions of joints that turn, recorded as angles of one turn: they jump by 2π, and are undone.

A jump is the wrap's where the step that is left once whole turns are taken off it is one that the
joint makes elsewhere, too. Whole turns are added to all of a run until it lies within the limits.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Run
from excite_cli.measurement.limits import Limits

_TURN = 2 * np.pi
_WHOLE = 1.001  # turns within which angles of one turn lie
_USUAL = 3.0  # times the largest step elsewhere that may be left of a jump
_STEP = 0.02  # rad: so much a step may be whatever the others are


def unwrapped(
    runs: Sequence[Run], joints: tuple[str, ...], limits: Limits
) -> tuple[list[Run], list[Finding]]:
    """Runs whose positions are continuous, and where they were not."""
    found, told = [], []
    for run in runs:
        q = run.q.copy()
        where = []
        for j in np.flatnonzero(limits.revolute).tolist():
            own = _continuous(run.q[:, j])
            if own is not None:
                q[:, j] = _within(own, float(limits.lower[j]), float(limits.upper[j]))
                where.append(joints[j])
        if where:
            text = f"positions of {', '.join(where)} jump by whole turns, and were made continuous"
            told.append(Finding("wrapped", "note", text, run.label, tuple(where)))
            run = replace(run, q=q)
        found.append(run)
    return found, told


def _continuous(q: Array) -> Array | None:
    """Positions (T,) without jumps of whole turns; None where there are none."""
    steps = np.diff(q)
    jumps = np.abs(steps) > np.pi
    if not jumps.any() or jumps.all() or np.ptp(q) > _TURN * _WHOLE:
        return None
    usual = max(float(np.abs(steps[~jumps]).max()), _STEP / _USUAL)
    turns = np.where(jumps, np.round(steps / _TURN), 0.0)
    if np.abs(steps - _TURN * turns)[jumps].max() > _USUAL * usual:
        return None
    return np.asarray(q - _TURN * np.concatenate([[0.0], np.cumsum(turns)]))


def _within(q: Array, lower: float, upper: float) -> Array:
    """The same, whole turns away, nearest to the middle of the limits."""
    middle = 0.5 * (lower + upper) if np.isfinite(lower + upper) else 0.0
    return np.asarray(q - _TURN * np.round((0.5 * (q.min() + q.max()) - middle) / _TURN))
