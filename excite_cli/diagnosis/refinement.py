"""Finer shapes around those that were found: a grid names an effect, it does not measure it."""

from collections.abc import Sequence

import numpy as np

from excite_cli.effects.base import Effect, Signals

# By how much a shape is changed up and down; passes repeat it from the best one.
_RATIOS = (1.35, 1.15, 1.06, 1.02)
_GAPS = (1.15, 1.06, 1.02, 1.007)  # a flight more or less changes much
_LEVELS = (1.05, 1.02, 1.008, 1.003, 1.001)  # of a cut-off level, which is seen directly
_CYCLES = (0.35, 0.15, 0.06, 0.02, 0.006)  # of a ripple, over the travelled range
_FIXED = ("power", "direction")


def shapes_around(effect: Effect, signals: Sequence[Signals]) -> list[dict]:
    """The effect's shape and neighbours of it, far and near, one parameter changed at a time."""
    found = [dict(effect.shape)]
    for name, value in effect.shape.items():
        if name in _FIXED:
            continue
        if name == "periods":
            j = effect.joints[0]
            low = min(float(s.q[:, j].min()) for s in signals)
            high = max(float(s.q[:, j].max()) for s in signals)
            changes = [2 * np.pi * cycles / max(high - low, 1e-6) for cycles in _CYCLES]
        elif name in ("start", "end"):
            width = max(abs(effect.shape["end"] - effect.shape["start"]), 0.05)
            changes = [(ratio - 1.0) * width for ratio in _RATIOS]
        else:
            ratios = {"level": _LEVELS, "gap": _GAPS}.get(name, _RATIOS)
            changes = [(ratio - 1.0) * value for ratio in ratios]
        found += [
            {**effect.shape, name: float(value + sign * change)}
            for change in changes
            for sign in (-1.0, 1.0)
        ]
    return found
