"""A clock that runs slow or fast, as speeds recorded by the drives show it.

Drives measure speed with a clock of their own. Where, on every joint alike, it is not the change of
position per recorded second, either the stamps or the unit of the speeds is wrong:

    ∫ v_recorded dt = gain · Δq,    a recorded second lasts 1/gain seconds.

Judged by what positions change over a window and by the speeds integrated over the same window, so
that neither encoder counts nor fast motion bias it.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.measurement.dataset import Array, Finding, Run

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
