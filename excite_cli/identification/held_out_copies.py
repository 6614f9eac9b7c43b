"""The guard of what is held out: what was fitted must not be judged on, whatever it is called.

A recording that is given once more, under another name, cut, shifted or with other time stamps,
holds the very same positions and torques to the last digit; two recordings of one motion do not,
for their torque is noisy. So the held-out part is cut into windows of a few dozen samples, and each
is looked for at every place of the training part, by a hash of its values.

Where a robot stands, coarse encoders repeat themselves: samples that repeat the one before count
once, and windows of few different samples not at all. Linear in samples; a run at a time.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import FileError
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Run, row_hashes
from excite_cli.workers.base import Tell
from excite_cli.workers.context import each

Hashes = NDArray[np.uint64]
_WINDOW = 32  # samples: beyond chance even for one joint with a coarse encoder
_DIFFERENT = _WINDOW // 2  # samples of a window that are not alike, at least
_MOST = 0.05  # share of the windows that may be found in training
_FACTOR = np.uint64(0x9E3779B97F4A7C15)


def refuse_held_out_copies(parts: Split) -> None:
    """See that the held-out part holds no samples of the training part.

    Raises
    ------
    FileError
        More than a twentieth of it do.
    """
    held_out = [_telling_windows(run) for run in parts.held_out]
    wanted = np.unique(np.concatenate(held_out)) if held_out else np.zeros(0, np.uint64)
    if not len(wanted):
        return
    there = np.zeros(len(wanted), bool)
    most, source = 0, parts.training[0]
    of_runs = each(_held, wanted, parts.training)
    for run, own in zip(parts.training, of_runs, strict=True):
        if (count := int(np.count_nonzero(own))) > most:
            most, source = count, run
        there |= own
    if there.mean() > _MOST:
        found = wanted[there]
        copies = [np.count_nonzero(np.isin(own, found)) for own in held_out]
        raise FileError(_told(parts.held_out[int(np.argmax(copies))], source, float(there.mean())))


def _held(wanted: Hashes, run: Run, tell: Tell) -> NDArray[np.bool_]:
    """Which of the `wanted` windows a run holds."""
    return np.isin(wanted, _hashed(_changing(run)))


def _told(held_out: Run, source: Run, share: float) -> str:
    what = f"{share:.0%} of what is held out is also in training"
    if held_out.id == source.id:
        return (
            f"Run '{held_out.id.key}'{_of([held_out])} repeats itself to the last digit: {what}, "
            "so that the error there says nothing. Record anew, or give only one of the copies."
        )
    return (
        f"Runs '{held_out.id.key}' and '{source.id.key}'{_of([held_out, source])} hold the same "
        f"samples to the last digit: {what}, so that the error there says nothing. Leave one of "
        "them out, or hold out another run with --held-out."
    )


def _of(runs: Sequence[Run]) -> str:
    files = dict.fromkeys(run.origin.file for run in runs if run.origin.file)
    return f" ({', '.join(files)})" if files else ""


def _changing(run: Run) -> Hashes:
    """Hashes of the samples as recorded, without those that repeat the one before."""
    rows = row_hashes(run) if run.recorded is None else run.recorded
    return rows[np.concatenate([[True], rows[1:] != rows[:-1]])]


def _hashed(rows: Hashes) -> Hashes:
    """Hash of the window that begins at each of the rows."""
    count = max(len(rows) - _WINDOW + 1, 0)
    found = np.zeros(count, np.uint64)
    for k in range(_WINDOW):
        found = found * _FACTOR + rows[k : k + count]
    return found


def _telling_windows(run: Run) -> Hashes:
    """Hashes of consecutive windows of enough different samples."""
    rows = _changing(run)
    count = len(rows) // _WINDOW
    windows = np.sort(rows[: count * _WINDOW].reshape(count, _WINDOW), axis=1)
    different = 1 + np.count_nonzero(np.diff(windows, axis=1), axis=1)
    return _hashed(rows)[::_WINDOW][:count][different >= _DIFFERENT]
