"""Time stamps: put in order, freed of duplicates, split at gaps, and made equidistant.

Everything above this package takes equidistant samples. Stamps that are so already (within 5 % of a
step) stay untouched, and so do their samples; else positions are interpolated by a cubic spline,
all other channels linearly. What was bridged is marked as not valid.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array, Finding, Mask, Run, row_hashes
from excite_cli.measurement.missing_values import BEYOND, rows_of
from excite_cli.measurement.run_identity import Part

_EVEN = 0.05  # of a step
_BRIDGED = 0.02  # s
_SHORTEST_PART = 0.5  # s
_SHORTEST_STEP = 1e-15  # s
_FEWEST = 10  # samples of a run
_BURST = 0.2  # share of stamps that follow at once
_MANY = 1000  # parts
_FILLED = 20  # times as many instants as there are samples, at most


@dataclass
class _Notes:
    run: str
    found: list[Finding]

    def add(self, kind: str, text: str, severity: str = "warning") -> None:
        self.found.append(Finding(kind, severity, text, self.run))  # type: ignore[arg-type]


def equidistant(run: Run) -> tuple[list[Run], list[Finding]]:
    """The run as equidistant parts, more than one where there are gaps.

    Where time starts anew in the file, another recording begins: `run/1`, `run/2` …

    Raises
    ------
    FileError
        Time stands still, or no part is long enough to be used.
    """
    notes = _Notes(run.name, [])
    if len(run.t) < _FEWEST:
        raise FileError(f"Run {run.name} has {len(run.t)} samples; at least {_FEWEST} are needed.")
    if not (run.t != run.t[0]).any():
        raise FileError(f"Run {run.name}: time stands still at {run.t[0]:g}: all stamps are equal.")
    steps = np.diff(run.t)
    typical = _typical(steps) or _typical(-steps)  # where time only goes back
    if not run.duration < BEYOND or 0 < typical < _SHORTEST_STEP:
        raise FileError(
            f"Run {run.name}: samples follow each other within {typical:.3g} s, "
            f"from {run.t[0]:g} to {run.t[-1]:g} s: no clock gives such time stamps. Check "
            "measurement.time and the recorder."
        )
    recordings = []
    for recording in _recordings(_without_strays(run, notes), notes):
        ordered = _spread_bursts(_ordered(recording, notes), notes)
        recordings.append(_split_at_gaps(_without_duplicates(ordered, notes), notes))
    pieces = [piece for recording in recordings for piece in recording]
    kept = [[p for p in each if len(pieces) == 1 or _is_long(p)] for each in recordings]
    long = [piece for recording in kept for piece in recording]
    if not long:
        raise FileError(
            f"Run {run.name} falls into {len(pieces)} pieces, none longer than {_SHORTEST_PART} s: "
            "its time stamps are too irregular. Check measurement.time and the recorder."
        )
    if len(long[0].t) < _FEWEST:
        raise FileError(
            f"Run {run.name}: of {len(run.t)} samples, {len(long[0].t)} have a time stamp of their "
            f"own that fits the others; at least {_FEWEST} are needed. Check measurement.time and "
            "the recorder."
        )
    if len(long) < len(pieces):
        lost = sum(len(p.t) for p in pieces) - sum(len(p.t) for p in long)
        notes.add(
            "short_part",
            f"{len(pieces) - len(long)} parts shorter than {_SHORTEST_PART} s between gaps are "
            f"left out ({lost} samples)",
        )
    if len(long) > _MANY:
        raise FileError(f"Run {run.name} has more than {_MANY} gaps; it cannot be used.")
    return [_resampled(part, notes) for part in _identified(kept)], notes.found


def _identified(recordings: list[list[Run]]) -> list[Run]:
    """All stretches, numbered where their recording has several; so are recordings of a file."""
    named = [stretches for stretches in recordings if stretches]
    if len(named) > 1:
        named = [
            [replace(run, name=f"{run.name}/{number}") for run in stretches]
            for number, stretches in enumerate(named, 1)
        ]
    found = []
    for stretches in named:
        if len(stretches) == 1:
            found += stretches
        else:
            parts = (replace(run.part, stretch=i) for i, run in enumerate(stretches, 1))
            found += [replace(run, part=p) for run, p in zip(stretches, parts, strict=True)]
    return found


def _is_long(run: Run) -> bool:
    return len(run.t) >= _FEWEST and run.duration >= _SHORTEST_PART


def _typical(steps: Array) -> float:
    forward = steps[steps > 0]
    return float(np.median(forward)) if len(forward) else 0.0


def _without_strays(run: Run, notes: _Notes) -> Run:
    """Single stamps far off, between neighbours that follow each other, take no part."""
    t, step = run.t, _typical(np.diff(run.t))
    between = (t[:-2] + t[2:]) / 2
    follow = (t[2:] > t[:-2]) & (t[2:] - t[:-2] < 4 * step)
    stray = follow & (np.abs(t[1:-1] - between) > 5 * step)
    if not stray.any():
        return run
    notes.add("stamps", f"{np.count_nonzero(stray)} stray time stamps are left out")
    return rows_of(run, np.concatenate([[True], ~stray, [True]]))


def _recordings(run: Run, notes: _Notes) -> list[Run]:
    """Where time starts anew, another recording begins; elsewhere samples came late."""
    steps = np.diff(run.t)
    back = np.flatnonzero(steps < -10 * _typical(steps)) + 1
    edges = np.concatenate([[0], back, [len(run.t)]])
    if not len(back) or np.diff(edges).min() < 50:
        return [run]
    notes.add("restart", f"time starts anew {len(back)} times: taken as {len(back) + 1} runs")
    return [run.cut(a, b) for a, b in pairwise(edges)]


def _ordered(run: Run, notes: _Notes) -> Run:
    late = int(np.count_nonzero(np.diff(run.t) < 0))
    if not late:
        return run
    notes.add("reordered", f"time goes back {late} times; samples are put in order of their stamps")
    order = np.argsort(run.t, kind="stable")
    return rows_of(run, order)


def _spread_bursts(run: Run, notes: _Notes) -> Run:
    """Stamps of a coarse clock, or of messages that arrive in bursts, laid on a line.

    Only where samples were evidently taken evenly: many follow at once, with other values, and
    the line is never off by more than a few steps.
    """
    steps = np.diff(run.t)
    mean = run.duration / len(steps)
    at_once = steps < 0.25 * mean
    changed = (run.q[1:] != run.q[:-1]).any(axis=1)
    even = np.linspace(run.t[0], run.t[-1], len(run.t))
    off = float(np.abs(run.t - even).max())
    if np.count_nonzero(at_once & changed) < _BURST * len(steps) or off > max(20 * mean, 0.05):
        return run
    notes.add(
        "bursts",
        f"{np.count_nonzero(at_once)} of {len(run.t)} samples carry nearly the stamp before them "
        "(a coarse clock, or messages that arrive in bursts): stamps are spread evenly, at "
        f"{1 / mean:.6g} Hz, by up to {off * 1e3:.3g} ms",
    )
    return replace(run, t=even)


def _without_duplicates(run: Run, notes: _Notes) -> Run:
    twice = np.concatenate([[False], np.diff(run.t) <= 0])
    if not twice.any():
        return run
    notes.add(
        "duplicate_stamps",
        f"{np.count_nonzero(twice)} samples carry the same stamp as the one before; left out",
    )
    return rows_of(run, ~twice)


def _split_at_gaps(run: Run, notes: _Notes) -> list[Run]:
    if len(run.t) < 3:
        return [run]
    steps = np.diff(run.t)
    step = _typical(steps)
    wide = steps > max(_BRIDGED, 3.5 * step)
    if not wide.any():
        return [run]
    cuts = np.flatnonzero(wide) + 1
    worst = int(np.argmax(steps))
    notes.add(
        "gap",
        f"{len(cuts)} gap{'s' if len(cuts) > 1 else ''} in time, the longest of "
        f"{steps[worst]:.3g} s at {run.t[worst]:.3f} s (sampled every {step:.3g} s): the run is "
        f"split there",
    )
    edges = np.concatenate([[0], cuts, [len(run.t)]])
    times = run.t - run.t[0]
    return [
        run.cut(a, b, Part(start=float(times[a]), end=float(times[b - 1])))
        for a, b in pairwise(edges)
    ]


def _resampled(run: Run, notes: _Notes) -> Run:
    """On equidistant instants; a short gap is bridged and marked."""
    steps = np.diff(run.t)
    step = float(np.median(steps))
    spread = 1.4826 * float(np.median(np.abs(steps - step)))
    missed = steps > max(1.75 * step, step + 5 * spread)
    whole = len(run.t) + float(np.round(steps[missed] / step - 1).sum())
    if not whole <= _FILLED * len(run.t):
        raise FileError(
            f"Run {run.name}: most of its {len(run.t)} samples follow each other within "
            f"{step:.3g} s, and others come after up to {steps.max():.3g} s: its time stamps are "
            "too irregular. Check measurement.time and the recorder."
        )
    count = int(whole)
    grid = np.linspace(run.t[0], run.t[-1], count)
    width = run.duration / (count - 1)
    if count == len(run.t):
        off = float(np.abs(run.t - grid).max()) / width
        if off <= _EVEN:
            return run
    jitter = float(np.std(steps[~missed])) / step
    if jitter > 0.01 or not missed.any():
        notes.add(
            "jitter",
            f"time stamps jitter by {jitter:.1%} of a step (worst step {steps.max():.4g} s, "
            f"typical {step:.4g} s): resampled at {1 / width:.6g} Hz",
            "warning" if jitter > 0.1 else "note",
        )
    valid = _on_grid(run, grid)
    if missed.any():
        place = np.searchsorted(run.t, grid, side="right") - 1
        place = np.clip(place, 0, len(steps) - 1)
        on_sample = np.minimum(grid - run.t[place], run.t[place + 1] - grid) < _EVEN * width
        bridged = missed[place] & ~on_sample
        valid[bridged] = False
        notes.add(
            "bridged",
            f"{np.count_nonzero(missed)} short gaps of up to {steps.max():.3g} s are bridged; "
            f"{np.count_nonzero(bridged)} interpolated samples are masked",
        )
    cubic = steps.min() > 0.2 * step  # closer stamps turn noise into overshoot
    q = CubicSpline(run.t, run.q)(grid) if cubic else _linear(run.t, run.q, grid)
    return replace(
        run,
        t=grid,
        q=q,
        tau=_linear(run.t, run.tau, grid),
        dq=None if run.dq is None else _linear(run.t, run.dq, grid),
        valid=None if valid.all() else valid,
        extra={key: _linear(run.t, value, grid) for key, value in run.extra.items()},
        covariates={k: _linear(run.t, value, grid) for k, value in run.covariates.items()},
        recorded=row_hashes(run)[_nearest(run.t, grid)],
    )


def _nearest(t: Array, grid: Array) -> NDArray[np.intp]:
    """The sample nearest to each instant."""
    return np.searchsorted((t[1:] + t[:-1]) / 2, grid)


def _on_grid(run: Run, grid: Array) -> Mask:
    """Valid where both neighbours are, or the one sample that lies there."""
    usable = run.usable()
    right = np.clip(np.searchsorted(run.t, grid), 0, len(run.t) - 1)
    left = np.where(run.t[right] > grid, np.maximum(right - 1, 0), right)
    return np.asarray(usable[left] & usable[right])


def _linear(t: Array, values: Array, grid: Array) -> Array:
    if values.ndim == 1:
        return np.interp(grid, t, values)
    return np.column_stack([np.interp(grid, t, column) for column in values.T])
