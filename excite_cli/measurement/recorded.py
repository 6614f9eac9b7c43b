"""When data were recorded and what else the log says of that time, for comparisons over months."""

from dataclasses import dataclass, field

import numpy as np

from excite_cli.measurement.dataset import Dataset


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
