"""Errors of a predicted torque: per joint, relative and in N·m, with an interval of their mean."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from excite_cli.errors import FileError
from excite_cli.identification.prepare import PreparedRun
from excite_cli.robot.model import Array

FEWEST = 10  # samples that an error may rest on
_DRAWS, _SEED = 1000, 20170529
_BLOCK = 1.0  # s, longer than what noise of the filtered torque remembers


@dataclass(frozen=True)
class Errors:
    """Of the torque on the held-out data: per joint, relative (RMS/RMS) and in N·m.

    `relative_moving` and `rms_moving` are of the samples in which the joint moves, all else of all.

    `interval` is the 95 % block-bootstrap interval of the mean relative error. `samples` per joint
    are the filtered ones that count. Files of earlier versions do not say, nor have `rms_moving`.
    """

    mean_relative: float
    mean_relative_moving: float
    relative: dict[str, float]
    relative_moving: dict[str, float]
    rms: dict[str, float]
    rms_raw: dict[str, float]
    interval: tuple[float, float]
    samples: dict[str, int] = field(default_factory=dict)
    rms_moving: dict[str, float] = field(default_factory=dict)


def torque_errors(
    joint_names: Sequence[str], runs: Sequence[PreparedRun], torques: Sequence[Array]
) -> Errors:
    """Compare the torque of runs with `torques` (T, n) that are predicted at their working rate.

    A joint with fewer than `FEWEST` (moving) samples has NaN and does not enter the mean.

    Raises
    ------
    FileError
        No joint has as many.
    """
    blocks = [block_sums(*both) for both in zip(runs, torques, strict=True)]
    sums = np.concatenate(blocks, axis=1)  # (6, blocks, n)
    wrong, size, wrong_moving, size_moving, count, count_moving = sums.sum(axis=1)
    enough, moves = count >= FEWEST, count_moving >= FEWEST
    if not enough.any():
        raise FileError(
            f"the data to judge by leave {count.max():.0f} filtered samples at most to any joint; "
            f"{FEWEST} are needed. The others were masked (stale, saturated, missing), or the runs "
            "are too short: record longer, or hold out another run."
        )
    relative = np.where(enough, _ratio(wrong, size), np.nan)
    relative_moving = np.where(moves, _ratio(wrong_moving, size_moving), np.nan)
    rms = np.sqrt(np.where(enough, wrong, np.nan) / np.maximum(count, 1))
    rms_moving = np.sqrt(np.where(moves, wrong_moving, np.nan) / np.maximum(count_moving, 1))
    raw = [run.tau_raw - torque for run, torque in zip(runs, torques, strict=True)]
    rms_raw = np.where(count > 0, np.sqrt(_mean(np.square(np.concatenate(raw)).T)), np.nan)
    return Errors(
        mean_relative=float(_mean(relative)),
        mean_relative_moving=float(_mean(relative_moving)),
        relative=_named(joint_names, relative),
        relative_moving=_named(joint_names, relative_moving),
        rms=_named(joint_names, rms),
        rms_raw=_named(joint_names, rms_raw),
        interval=_interval(sums[0] * enough, sums[1] * enough),
        samples={name: int(each) for name, each in zip(joint_names, count, strict=True)},
        rms_moving=_named(joint_names, rms_moving),
    )


def block_sums(run: PreparedRun, torque: Array, seconds: float = _BLOCK) -> Array:
    """Per block of about so many seconds of a run, beside a predicted torque: (6, blocks, n).

    ‖e‖², ‖τ‖², the same where moving, both counts. The last block has at least half the length.
    """
    tau, usable, predicted = run.tau, run.valid, run.averaged_torque(torque)
    good, slow = usable.astype(float), (usable & run.moving).astype(float)
    error = np.square(np.where(usable, tau - predicted, 0.0))
    size = np.square(np.where(usable, tau, 0.0))
    rows = np.stack([error, size, error * slow, size * slow, good, slow])
    length = max(1, round(seconds / run.step))
    edges = np.arange(0, max(len(tau) - length // 2, 1), length)
    return np.add.reduceat(rows, edges, axis=1)


def _ratio(wrong: Array, size: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(size > 0, np.sqrt(wrong / np.where(size > 0, size, 1.0)), np.nan)


def _mean(values: Array) -> Array:
    """Along the last axis, of what is finite; NaN where nothing is."""
    good = np.isfinite(values)
    count = good.sum(axis=-1)
    total = np.where(good, values, 0.0).sum(axis=-1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _named(names: Sequence[str], values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def _interval(wrong: Array, size: Array) -> tuple[float, float]:
    """2.5 and 97.5 % of the mean relative error over blocks (B, n) drawn with replacement."""
    draws = drawn_blocks(len(wrong))
    means = _mean(_ratio(draws @ wrong, draws @ size))
    means = means[np.isfinite(means)]
    if len(wrong) < 2 or not len(means):
        return float("nan"), float("nan")
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def drawn_blocks(count: int) -> NDArray[np.int64]:
    """How often each of so many blocks is drawn, with replacement: (draws, count)."""
    rng = np.random.default_rng(_SEED)
    return rng.multinomial(count, np.full(count, 1 / count), _DRAWS)
