"""Recorded speeds that come late: by a delay, or behind a first-order filter.

A filter with the time constant T makes of the speed v what obeys T ẏ + y = v. At slow motion that
looks like a delay of T, at faster motion it is less, so both are tried.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from excite_cli.measurement.dataset import Array, Finding, Run

_LAG = 0.01  # s, worth a word
_LONGEST = 0.5  # s
_MOST_LAGS = 2000  # samples: the time taken grows with it, and no robot is sampled so fast
_BETTER = 0.7  # of what a delay leaves, for a filter to be named instead


def check_lag(runs: Sequence[Run], used: bool, where: str) -> list[Finding]:
    """One finding if recorded speeds come late, or early; `used`: accelerations are made of them.

    `runs` are equidistant and have speeds; `where` names them.
    """
    lags = np.array([speed_lag(run, _LONGEST) for run in runs])
    if not np.isfinite(lags).any():
        return []
    lag, step = float(np.nanmedian(lags)), max(run.step for run in runs)
    if not abs(lag) > max(_LAG, 2.5 * step):
        return []
    delayed = _left([_shifted(run, lag) for run in runs])
    seconds = _time_constant(runs) if lag > 0 else 0.0
    filtered = _left([_behind_filter(run, seconds) for run in runs]) if seconds else np.inf
    if filtered < _BETTER * delayed:
        what = (
            f"are differentiated positions through a first-order low-pass of {seconds:.3g} s "
            f"(relative misfit {filtered:.2g}; a pure delay: {delayed:.2g})"
        )
    else:
        way = "after" if lag > 0 else "before"
        what = f"come {abs(lag) * 1e3:.3g} ms {way} the differentiated positions"
    use = (
        "measurement.filter.velocity: measured makes accelerations of them; write differentiated"
        if used
        else "they are not used, positions are differentiated"
    )
    text = (
        f"recorded speeds {what}: {use}. If positions are delayed too, a torque delay is found. "
        "To silence this, leave the speeds out (measurement.channels: {dq: null})"
    )
    return [Finding("lag", "warning", text, where)]


def speed_lag(run: Run, longest: float = 0.1) -> float:
    """Lag of the recorded speed behind the differentiated positions [s], all joints together.

    Where their cross-correlation is largest within `longest` [s], by a parabola between samples;
    NaN where no speed was recorded. `run` is equidistant.
    """
    count = len(run.t)
    reach = int(min(np.ceil(longest / run.step), count // 4, _MOST_LAGS))
    if run.dq is None or reach < 2:
        return float("nan")
    v, dq = _scaled(run)
    lags = np.arange(-reach, reach + 1)
    dq[:reach] = dq[count - reach :] = 0.0
    energy = np.concatenate([[0.0], np.cumsum(np.square(v).sum(axis=1))])
    shifted_in = np.sqrt(np.maximum(energy[count - reach - lags] - energy[reach - lags], 0.0))
    # Over the norm of what is shifted in: largest where both are parallel, wherever it is cut.
    match = _products(dq, v, lags) / np.maximum(shifted_in, 1e-300)
    best = int(np.argmax(match))
    if best in (0, len(lags) - 1):
        return float("nan")  # beyond what is looked for
    left, middle, right = match[best - 1 : best + 2]
    bend = left - 2 * middle + right
    return float((lags[best] + (0.5 * (left - right) / bend if bend < 0 else 0.0)) * run.step)


def _products(dq: Array, v: Array, lags: NDArray[np.intp]) -> Array:
    """Σ dq_t v_{t−k} over samples and joints for every lag k; dq is zero as far from its ends."""
    from scipy.fft import irfft, next_fast_len, rfft  # takes a second to import

    size = next_fast_len(len(v), real=True)
    total = np.zeros(size)
    for one, other in zip(dq.T, v.T, strict=True):
        total += irfft(rfft(one, size) * np.conj(rfft(other, size)), size)
    return total[lags]


def _scaled(run: Run) -> tuple[Array, Array]:
    """Differentiated and recorded speeds (T, n), every joint in units of its own."""
    assert run.dq is not None
    scale = np.maximum(run.dq.std(axis=0), 1e-300)
    return np.gradient(run.q, run.step, axis=0) / scale, run.dq / scale


def _shifted(run: Run, lag: float) -> tuple[Array, Array]:
    v, dq = _scaled(run)
    late = np.column_stack([np.interp(run.t - lag, run.t, column) for column in v.T])
    edge = int(np.ceil(abs(lag) / run.step))
    return late[edge : len(late) - edge], dq[edge : len(dq) - edge]


def _behind_filter(run: Run, seconds: float) -> tuple[Array, Array]:
    """The change of position filtered, from the recorded speed on, and what was recorded."""
    from scipy.signal import lfilter  # takes a second to import

    v, dq = _scaled(run)
    keep = np.exp(-run.step / seconds)
    return lfilter([1 - keep], [1, -keep], v[1:], axis=0, zi=keep * dq[:1])[0], dq[1:]


def _left(pairs: Sequence[tuple[Array, Array]]) -> float:
    """Share of the recorded speeds that the first of a pair leaves."""
    rest = sum(float(np.square(dq - x).sum()) for x, dq in pairs)
    return float(np.sqrt(rest / sum(float(np.square(dq).sum()) for _, dq in pairs)))


def _time_constant(runs: Sequence[Run]) -> float:
    """Of the first-order filter that leaves least of the recorded speeds [s]."""
    from scipy.optimize import minimize_scalar  # slow to import

    low, high = np.log(0.3 * _LAG), np.log(2 * _LONGEST)
    found = minimize_scalar(
        lambda x: _left([_behind_filter(run, float(np.exp(x))) for run in runs]),
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-3},
    )
    return float(np.exp(found.x))
