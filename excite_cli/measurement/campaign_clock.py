"""The campaign's clock: when each recording began, counted from the first one.

Absolute stamps say it where every recording has them and no two overlap (a clock that starts anew
with every recording says nothing). Else recordings follow each other in the order in which they are
given, each beginning where the one before it ended.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from excite_cli.measurement.dataset import Dataset, Run

# When data were recorded and what else the log says of that time, for comparisons over months.


@dataclass(frozen=True)
class Recorded:
    """`epoch` of the first recording [s], if stamps tell; `covariates`: means of columns."""

    epoch: float | None = None
    covariates: dict[str, float] = field(default_factory=dict)


def recorded(data: Dataset) -> Recorded:
    """When `data` were recorded, and means over all runs of what else was."""
    stamps = [run.epoch for run in data.runs if run.epoch is not None]
    names = set.intersection(*(set(run.covariates) for run in data.runs)) if data.runs else set()
    return Recorded(
        float(min(stamps)) if stamps else None,
        {
            name: float(np.mean(np.concatenate([run.covariates[name] for run in data.runs])))
            for name in sorted(names)
        },
    )


_OVERLAP = 1.0  # s by which stamps of two recordings may cross: clocks are set while they run

Spans = dict[str, tuple[float, float]]


def on_campaign_clock(runs: Sequence[Run]) -> list[Run]:
    """The runs with `start`, the campaign's time at their t = 0 [s]."""
    epochs = {run.name: run.epoch for run in runs}
    spans = _spans(runs)
    begins = _by_stamps(epochs, spans) or _in_order(spans)
    return [replace(run, start=begins[run.name]) for run in runs]


def _spans(runs: Sequence[Run]) -> Spans:
    """First and last instant of each recording, on its own clock."""
    found: Spans = {}
    for run in runs:
        first, last = found.get(run.name, (float("inf"), float("-inf")))
        found[run.name] = min(first, float(run.t[0])), max(last, float(run.t[-1]))
    return found


def _by_stamps(epochs: dict[str, float | None], spans: Spans) -> dict[str, float] | None:
    """Campaign time at t = 0; None where stamps are missing or cannot be."""
    known = {name: epoch for name, epoch in epochs.items() if epoch is not None}
    if len(known) < len(epochs):
        return None
    ordered = sorted((known[name] + span[0], known[name] + span[1]) for name, span in spans.items())
    if any(after[0] < before[1] - _OVERLAP for before, after in pairwise(ordered)):
        return None
    return {name: epoch - ordered[0][0] for name, epoch in known.items()}


def _in_order(spans: Spans) -> dict[str, float]:
    """Campaign time at t = 0 of recordings that follow each other without a pause."""
    begins, end = {}, 0.0
    for name, (first, last) in spans.items():
        begins[name] = end - first
        end += last - first
    return begins
