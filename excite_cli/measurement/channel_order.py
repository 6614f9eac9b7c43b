"""Columns in another order, or with another sign, as far as speeds and positions show it."""

from collections.abc import Sequence

import numpy as np

from excite_cli.measurement.dataset import Finding, Run
from excite_cli.measurement.speeds import speeds

_LAG = 0.01  # s, worth a word
_MOST_LAGS = 2000  # samples: the time taken grows with it, and no robot is sampled so fast
_FOREIGN, _OWN, _OPPOSITE = 0.9, 0.5, -0.8


def check_order(runs: Sequence[Run], joints: tuple[str, ...]) -> list[Finding]:
    """Recorded speeds that follow another joint's positions, go the other way, or lag behind."""
    if any(run.dq is None for run in runs):
        return []
    where = ", ".join(run.label for run in runs)
    correlation = speeds(runs).correlation()
    own = np.diag(correlation)
    foreign = np.where(np.eye(len(joints), dtype=bool), 0.0, correlation)
    best = np.argmax(foreign, axis=1)
    swapped = (foreign.max(axis=1) > _FOREIGN) & (own < _OWN)
    findings = []
    if swapped.any():
        pairs = [
            f"the speed of {joints[i]} follows {joints[best[i]]}" for i in swapped.nonzero()[0]
        ]
        text = (
            f"columns of positions and speeds are in different orders: {', '.join(pairs)}. Correct "
            "the names in the file; if torques are in the order of the positions, leave the "
            "speeds out (measurement.channels: {dq: null})"
        )
        named = tuple(joints[i] for i in swapped.nonzero()[0])
        findings.append(Finding("swapped", "error", text, where, named))
    for j in np.flatnonzero((own < _OPPOSITE) & ~swapped):
        joint = joints[j]
        text = (
            f"recorded speed of {joint} has the opposite sign of its change of position. Either "
            f"positions count the wrong way (measurement.position_sign: {{{joint}: -1}}) or "
            f"speeds do (measurement.velocity_sign: {{{joint}: -1}})"
        )
        findings.append(Finding("sign", "error", text, where, (joint,)))
    return findings or [found for run in runs for found in _lagging(run)]


def _lagging(run: Run) -> list[Finding]:
    lag = speed_lag(run)
    if not abs(lag) > max(_LAG, 2.5 * run.step):
        return []
    text = (
        f"recorded speeds come {abs(lag) * 1e3:.3g} ms {'after' if lag > 0 else 'before'} the "
        "change of position: one of them is filtered or late, and the torque may be too"
    )
    return [Finding("lag", "warning", text, run.label)]


def speed_lag(run: Run, longest: float = 0.1) -> float:
    """Lag of the recorded speed behind the differentiated positions [s], all joints together.

    Where their cross-correlation is largest within `longest` [s], by a parabola between samples;
    NaN where no speed was recorded. `run` is equidistant.
    """
    count = len(run.t)
    reach = int(min(np.ceil(longest / run.step), count // 4, _MOST_LAGS))
    if run.dq is None or reach < 2:
        return float("nan")
    scale = np.maximum(run.dq.std(axis=0), 1e-300)
    v, dq = np.gradient(run.q, run.step, axis=0) / scale, run.dq / scale
    inner = slice(reach, count - reach)
    lags = np.arange(-reach, reach + 1)
    shifted = (v[reach - k : count - reach - k] for k in lags)
    # Over the norm of what is shifted in: largest where both are parallel, wherever it is cut.
    match = np.array([(dq[inner] * x).sum() / max(np.linalg.norm(x), 1e-300) for x in shifted])
    best = int(np.argmax(match))
    if best in (0, len(lags) - 1):
        return float("nan")  # beyond what is looked for
    left, middle, right = match[best - 1 : best + 2]
    bend = left - 2 * middle + right
    return float((lags[best] + (0.5 * (left - right) / bend if bend < 0 else 0.0)) * run.step)
