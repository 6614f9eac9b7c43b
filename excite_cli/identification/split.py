"""What is fitted and what is sealed: whole runs, or blocks of a single one.

Blocks are cut before any filter runs, so that nothing of a sealed block leaks into its neighbours.
"""

import re
from dataclasses import dataclass, replace

from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.dataset import Dataset, Run

# A single run is cut into about this many blocks of one to two seconds; every third is sealed.
_BLOCKS, _SHORTEST, _LONGEST = 9, 1.0, 2.0
_EVERY = 3
# What is added to the name of a run for a part of it.
_PART = re.compile(r" (?:[^ ]+-[^ ]+ s|\((?:first|second) half\))$")


@dataclass(frozen=True)
class Split:
    """Training and sealed parts, and the fold (left out together) of each training part."""

    training: tuple[Run, ...]
    sealed: tuple[Run, ...]
    sealed_name: str
    folds: tuple[int, ...]


def split(dataset: Dataset, sealed: str | None = None, block: float | None = None) -> Split:
    """Seal a run (the last, unless `sealed` names one); a single run is cut into blocks of time.

    Raises
    ------
    ConfigError
        There is no run of that name, or a single run is too short to be cut.
    """
    runs = [replace(run, t=run.t - run.t[0]) for run in dataset.runs]
    names = [run.name for run in runs]
    if sealed is not None and sealed not in names:
        raise ConfigError(
            f"--sealed: there is no run '{sealed}'.{nearest(sealed, names)} "
            f"Runs: {', '.join(names)}."
        )
    if len(names) == 1:
        return _blocks(runs[0], block)
    sealed = sealed or names[-1]
    training = tuple(run for run in runs if run.name != sealed)
    kept = tuple(run for run in runs if run.name == sealed)
    if len(training) == 1:  # folds are still needed: halves of the only run
        run = training[0]
        middle = len(run.t) // 2
        parts = (run.part(0, middle, f"{run.name} (first half)"),
                 run.part(middle, len(run.t), f"{run.name} (second half)"))  # fmt: skip
        return Split(parts, kept, sealed, (0, 1))
    return Split(training, kept, sealed, tuple(range(len(training))))


def _blocks(run: Run, block: float | None) -> Split:
    length = block or min(max(run.duration / _BLOCKS, _SHORTEST), _LONGEST)
    count = round(run.duration / length)
    if count < _EVERY:
        raise ConfigError(
            f"run '{run.name}' lasts {run.duration:.3g} s: too short to seal a part of it. Give "
            "at least two runs, or one of at least 3 s (diagnosis.block sets the blocks' length)."
        )
    edges = [round(i * (len(run.t)) / count) for i in range(count + 1)]
    training, sealed = [], []
    start = 0
    for i in range(count):
        if i % _EVERY == _EVERY - 1:
            if start < i:
                training.append(_named(run, edges[start], edges[i]))
            sealed.append(_named(run, edges[i], edges[i + 1]))
            start = i + 1
    if start < count:
        training.append(_named(run, edges[start], edges[count]))
    blocks = "1 block" if len(sealed) == 1 else f"{len(sealed)} blocks"
    share = f"{blocks} of {run.duration / count:.3g} s of {run.name}"
    # Few folds, each of stretches spread over the run.
    folds = tuple(i % min(len(training), 4) for i in range(len(training)))
    return Split(tuple(training), tuple(sealed), share, folds)


def _named(run: Run, first: int, last: int) -> Run:
    times = f"{run.t[first]:.4g}-{run.t[last - 1]:.4g} s"
    return run.part(first, last, f"{run.name} {times}")


def run_name(part: str) -> str:
    """The run a part of it belongs to."""
    return _PART.sub("", part)
