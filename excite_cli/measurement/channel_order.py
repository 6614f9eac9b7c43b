"""Columns in another order, or with another sign, as far as speeds and positions show it."""

from collections.abc import Sequence

import numpy as np

from excite_cli.measurement.dataset import Finding, Run
from excite_cli.measurement.speed_lag import check_lag
from excite_cli.measurement.speeds import speeds

_FOREIGN, _OWN, _OPPOSITE = 0.9, 0.5, -0.8


def check_order(runs: Sequence[Run], joints: tuple[str, ...], used: bool = False) -> list[Finding]:
    """Recorded speeds that follow another joint's positions, go the other way, or lag behind.

    `used`: accelerations are made of the recorded speeds.
    """
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
    return findings or check_lag(runs, used, where)
