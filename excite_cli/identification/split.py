"""What is fitted and what is held out: whole recordings, or blocks of a single one.

A recording with gaps is held out, or left out, with all its stretches; if there is no other, its
stretches count as recordings. Blocks are cut before any filter runs, so that nothing of a held-out
block leaks into its neighbours. Very long parts are cut once more: memory does not grow with them.

Of runs with effects of their own the end may be held out, too: only there it shows what such an
effect is worth on data that took no part.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from excite_cli.errors import ConfigError, nearest
from excite_cli.identification.processing import Processing
from excite_cli.measurement.campaign_clock import on_campaign_clock
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.run_identity import Part, RunId

# A single run is cut into about this many blocks of one to two seconds; every third is held out.
_BLOCKS, _SHORTEST, _LONGEST = 9, 1.0, 2.0
# Samples that a block has at least: the filters for slow recordings (cut off at a fifth of their
# rate) take 21 at its borders, and 15 give the dozen averages that a part should have. Of 83
# simulated recordings five, at 10 and 25 Hz, were refused for blocks of a second or two.
_SAMPLES = 36
_MOST_BLOCKS = 120  # of long ones: each loses its borders, and costs its share of time
_MOST_SAMPLES = 400_000  # of a part
_EVERY = 3
_FEWEST = 10  # samples of a block
_MOVES = 0.05  # of a joint's largest span in a run: what is less is rest
_MOST_FOLDS = 8


@dataclass(frozen=True)
class Split:
    """Training and held-out parts, and the fold (left out together) of each training part.

    `units`: what can be held out, in order: recordings, or the stretches of the only one.
    `held_out_name` tells people what is held out; `ends` are those of training runs that are held
    out beside it.
    """

    training: tuple[Run, ...]
    held_out: tuple[Run, ...]
    held_out_name: str
    folds: tuple[int, ...]
    units: tuple[str, ...]
    ends: tuple[Run, ...] = ()

    def unit(self, run: RunId) -> str:
        """The unit that a run belongs to."""
        return run.name if run.name in self.units else run.key


def whole(dataset: Dataset) -> list[Run]:
    """All runs with time from their recording's start, on the campaign's clock; none held out."""
    return on_campaign_clock([_from_start(run) for run in dataset.runs])


def split(
    dataset: Dataset,
    held_out: str | None = None,
    block: float | None = None,
    needed: Collection[str] = (),
) -> Split:
    """Hold out a recording (the last, unless `held_out` names one, or a stretch of one).

    A single one without gaps is cut into blocks of time; so is each, where every joint is moved in
    a recording of its own. Time counts from a recording's start. Of those that are `needed` for the
    fit, or alone move a joint, none is held out, unless it is named or there is no other.

    Raises
    ------
    ConfigError
        There is no run of that name, or a single run is too short to be cut.
    """
    runs = whole(dataset)
    if held_out is not None and held_out not in dataset.names:
        raise ConfigError(
            f"--held-out: there is no run '{held_out}'.{nearest(held_out, dataset.names)} "
            f"Runs: {', '.join(dataset.names)}."
        )
    units = dataset.recordings
    if len(units) == 1:
        units = tuple(dict.fromkeys(run.id.key for run in dataset.runs))
    if len(runs) == 1:
        return _blocks(runs[0], block)
    if held_out is None or all(run.id.is_among((held_out,)) for run in runs):
        others = [unit for unit in units if unit not in needed] or list(units)
        free = [unit for unit in others if _is_shown_elsewhere(unit, runs)]
        if not free and held_out is None and block is None:
            return _blocks_of_each(runs, units)
        held_out = (free or others)[-1]
    training = [run for run in runs if not run.id.is_among((held_out,))]
    kept = [run for run in runs if run.id.is_among((held_out,))]
    if not training:
        raise ConfigError(
            f"all {len(runs)} runs are called '{held_out}': none is left to fit. Give each "
            "recording a name of its own."
        )
    if len(training) == 1:  # folds are still needed: halves of the only run
        run = training[0]
        middle = len(run.t) // 2
        training = [_block(run, 1, 0, middle), _block(run, 2, middle, len(run.t))]
    training, kept = _short(training), _short(kept)
    return Split(tuple(training), tuple(kept), held_out, _folds(training), units)


def with_ends_held_out(parts: Split, runs: Collection[str], processing: Processing) -> Split:
    """The last third of each of these training `runs` held-out as well, where it is long enough.

    Between both parts lies the border that filters cut off.
    """
    training: list[Run] = []
    ends: list[Run] = []
    least = max(_SHORTEST, processing.shortest)
    for run in parts.training:
        count = len(run.t)
        end = count - round(max(run.duration / _EVERY, least) / run.step)
        start = end - round(processing.border / run.step)
        if run.id.is_among(runs) and start * run.step > least:
            number = run.part.block or 1
            training.append(_block(run, number, 0, start))
            ends.append(_block(run, number + 1, end, count))
        else:
            training.append(run)
    return replace(parts, training=tuple(training), ends=tuple(ends))


def _short(runs: Sequence[Run]) -> list[Run]:
    """The same in parts of some minutes: what is made of a part at once must have room."""
    found: list[Run] = []
    for run in runs:
        count = -(-len(run.t) // _MOST_SAMPLES)
        edges = [round(i * len(run.t) / count) for i in range(count + 1)]
        if count == 1:
            found.append(run)
            continue
        first = max(run.part.block or 1, 1 + sum(each.id == run.id for each in found))
        found += [_block(run, first + i, *ends) for i, ends in enumerate(pairwise(edges))]
    return found


def _from_start(run: Run) -> Run:
    """The run with its time counted from the start of its recording."""
    shift = run.t[0] - run.part.start if run.part.start else run.t[0]
    epoch = None if run.epoch is None else run.epoch + float(shift)
    return replace(run, t=run.t - shift, epoch=epoch)


def _folds(training: list[Run]) -> tuple[int, ...]:
    """A fold for each recording, of a single one for each of its parts; in turn, if they are many.

    Time and memory of a diagnosis grow with the folds.
    """
    names = list(dict.fromkeys(run.name for run in training))
    if len(names) == 1:
        return tuple(i % _MOST_FOLDS for i in range(len(training)))
    return tuple(names.index(run.name) % _MOST_FOLDS for run in training)


def _blocks(run: Run, block: float | None) -> Split:
    length = min(max(run.duration / _BLOCKS, _SHORTEST), _LONGEST)
    few = min(_SAMPLES * run.step, run.duration / _EVERY)
    length = block or max(length, few, run.duration / _MOST_BLOCKS)
    count = round(run.duration / length)
    if count < _EVERY:
        raise ConfigError(
            f"run '{run.label}' lasts {run.duration:.3g} s: too short to hold out a part of it. "
            "Give at least two runs, or one of at least 3 s (diagnosis.block: length of blocks)."
        )
    if count * _FEWEST > len(run.t):
        raise ConfigError(
            f"diagnosis.block: blocks of {length:g} s of run '{run.label}' hold "
            f"{len(run.t) / count:.3g} samples each; {_FEWEST} are needed at least. Give longer "
            "blocks, or leave this key out."
        )
    edges = [round(i * len(run.t) / count) for i in range(count + 1)]
    training, held_out = [], []
    for first in range(0, count, _EVERY):
        last = min(first + _EVERY - 1, count)
        training.append(_block(run, last, edges[first], edges[last]))
        if last < count:
            held_out.append(_block(run, last + 1, edges[last], edges[last + 1]))
    blocks = "1 block" if len(held_out) == 1 else f"{len(held_out)} blocks"
    share = f"{blocks} of {run.duration / count:.3g} s of {run.label}"
    # Few folds, each of stretches spread over the run.
    folds = tuple(i % min(len(training), 4) for i in range(len(training)))
    return Split(tuple(training), tuple(held_out), share, folds, (run.id.key,))


def _is_shown_elsewhere(unit: str, runs: Sequence[Run]) -> bool:
    """Whether other runs move every joint that a unit moves, too."""
    spans = np.array([np.ptp(run.q, axis=0) for run in runs])
    moves = spans > _MOVES * spans.max(axis=0)
    own = np.array([run.id.is_among((unit,)) for run in runs])
    return bool((moves[~own].any(axis=0) | ~moves[own].any(axis=0)).all())


def _blocks_of_each(runs: Sequence[Run], units: tuple[str, ...]) -> Split:
    """Every third block of each run held out."""
    parts = [_blocks(run, None) for run in runs]
    return Split(
        tuple(run for part in parts for run in part.training),
        tuple(run for part in parts for run in part.held_out),
        f"every third block of each of {len(units)} runs",
        tuple(fold for part in parts for fold in part.folds),
        units,
    )


def _block(run: Run, number: int, first: int, last: int) -> Run:
    times = float(run.t[first]), float(run.t[last - 1])
    return run.cut(first, last, Part(run.part.stretch, number, *times))
