"""Speeds from positions, beside the recorded ones: what units and signs are judged by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.measurement.dataset import Array, Mask, Run

_FOLLOWS = 0.8  # correlation


@dataclass(frozen=True)
class Speeds:
    """Speeds differentiated from positions over a short stride, (T', n); `recorded` if it was."""

    differentiated: Array
    recorded: Array | None

    @property
    def fastest(self) -> Array:
        """99th percentile of |v| per joint (n,): single outliers do not count."""
        return np.percentile(np.abs(self.differentiated), 99, axis=0)

    def correlation(self) -> Array:
        """(n, n): recorded speed of joint i (row) with differentiated positions of joint j."""
        assert self.recorded is not None
        x, y = _normed(self.recorded), _normed(self.differentiated)
        return x.T @ y

    def gain(self) -> Array:
        """Recorded over differentiated speed, least squares per joint (n,); NaN without motion."""
        assert self.recorded is not None
        own = (self.differentiated**2).sum(axis=0)
        product = (self.recorded * self.differentiated).sum(axis=0)
        return np.divide(product, own, out=np.full(len(own), np.nan), where=own > 0)


def following(found: Speeds, among: Mask) -> tuple[Mask, Array]:
    """Joints (n,) whose recorded speeds follow their own positions, and the size of their gains."""
    if found.recorded is None:
        return np.zeros(len(among), bool), np.zeros(len(among))
    follows = (np.abs(np.diag(found.correlation())) > _FOLLOWS) & among
    return follows, np.abs(np.nan_to_num(found.gain()))


def usual_gain(found: Speeds, among: Mask | None = None) -> float:
    """Median gain of the recorded speeds of joints that follow their own positions; NaN if none."""
    everywhere = np.ones(found.differentiated.shape[1], bool)
    follows, gains = following(found, everywhere if among is None else among)
    return float(np.median(gains[follows])) if follows.any() else float("nan")


def _normed(x: Array) -> Array:
    x = x - x.mean(axis=0)
    size = np.sqrt((x**2).sum(axis=0))
    return np.divide(x, size, out=np.zeros_like(x), where=size > 0)


def speeds(runs: Sequence[Run]) -> Speeds:
    """Speeds of equidistant runs, one after the other."""
    found = [_of_run(run) for run in runs]
    recorded = [dq for _, dq in found]
    return Speeds(
        np.concatenate([v for v, _ in found]),
        None if any(dq is None for dq in recorded) else np.concatenate(recorded),  # type: ignore[arg-type]
    )


def _of_run(run: Run) -> tuple[Array, Array | None]:
    # A stride of some samples keeps the encoder's steps out, without blurring the motion.
    stride = int(np.clip(len(run.t) // 400, 1, 10))
    ahead = slice(2 * stride, None)
    behind = slice(None, -2 * stride)
    moved = run.q[ahead] - run.q[behind]
    v = moved / (run.t[ahead] - run.t[behind])[:, None]
    return v, None if run.dq is None else run.dq[stride:-stride]


def extremes(runs: Sequence[Run]) -> tuple[Array, Array]:
    """Lowest and highest positions (n,) of all runs."""
    return (
        np.min([run.q.min(axis=0) for run in runs], axis=0),
        np.max([run.q.max(axis=0) for run in runs], axis=0),
    )
