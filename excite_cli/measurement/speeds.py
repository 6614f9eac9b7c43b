"""Speeds from positions, beside the recorded ones: what units and signs are judged by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Mask, Run

# A clock that runs slow or fast, as speeds recorded by the drives show it.
#
# Drives measure speed with a clock of their own. Where, on every joint alike, it is not the change
# of position per recorded second, either the stamps or the unit of the speeds is wrong:
#
#     ∫ v_recorded dt = gain · Δq,    a recorded second lasts 1/gain seconds.
#
# Judged by what positions change over a window and by the speeds integrated over the same window,
# so that neither encoder counts nor fast motion bias it.

_OFF = 0.02  # share by which all gains miss 1
_ALIKE = 0.01  # share by which gains of joints may differ
_FARTHEST = 5.0  # that a clock is off
_LEFT = 0.05  # share of the recorded speeds that a gain may leave
_WINDOW = 0.1  # s
_NARROW = 10  # samples: a step of an encoder is little beside what so many move
_FEWEST = 2  # joints


def check_clock(runs: Sequence[Run], where: str) -> list[Finding]:
    """One finding if the recorded speeds of all joints that move are off by one factor.

    `runs` are equidistant; `where` names them.
    """
    if any(run.dq is None for run in runs):
        return []
    gains = _gains(runs)
    if len(gains) < _FEWEST or not np.isfinite(gains).all():
        return []
    gain = float(np.median(gains))
    numbered = all((run.t == np.round(run.t)).all() for run in runs)
    if gain == 0.0 or abs(gain - 1) < _OFF or np.ptp(gains) > _ALIKE * gain:
        return []
    if not (numbered or 1 / _FARTHEST < gain < _FARTHEST):  # a unit, not a clock
        return []
    text = (
        f"recorded speeds are {gain:.4g} times the change of position per time, on every joint "
        f"alike ({gains.min():.4g} to {gains.max():.4g}): a recorded second lasts "
        f"{1 / gain:.4g} s. If the stamps are wrong, write measurement.clock: {1 / gain:.4g}; if "
        "they are right, leave the speeds out (measurement.channels: {dq: null})"
    )
    settings = {"measurement.clock": float(f"{1 / gain:.4g}")}
    if numbered:  # no drive's speeds are so far off
        text = f"time stamps are the numbers of the samples, not seconds: {text}"
        return [Finding("clock", "error", text, where, (), settings)]
    return [Finding("clock", "warning", text, where, (), settings)]


def _gains(runs: Sequence[Run]) -> Array:
    """Gain of every joint that moves; NaN where the speeds are not the positions' own."""
    moved, integrated = (
        np.concatenate(each) for each in zip(*map(_over_windows, runs), strict=True)
    )
    own = np.sum(moved**2, axis=0)
    moves = own > 1e-4 * own.max()
    gains = np.sum(moved * integrated, axis=0)[moves] / own[moves]
    left = np.linalg.norm(integrated[:, moves] - gains * moved[:, moves], axis=0)
    return np.where(left < _LEFT * np.abs(gains) * np.sqrt(own[moves]), gains, np.nan)


def _over_windows(run: Run) -> tuple[Array, Array]:
    """Δq and ∫ v dt over windows (T', n)."""
    assert run.dq is not None
    # Steps of 1e-310 s come from damaged stamps: their window is as long as the data allow.
    width = int(np.clip(_WINDOW / run.step, _NARROW, max(len(run.t) // 4, 1)).round())
    path = np.cumsum((run.dq[1:] + run.dq[:-1]) / 2 * run.step, axis=0)
    path = np.vstack([np.zeros(run.q.shape[1]), path])
    return run.q[width:] - run.q[:-width], path[width:] - path[:-width]


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
