"""Finer shapes around those that were found: a grid names an effect, it does not measure it."""

from collections.abc import Sequence

import numpy as np

from excite_cli.effects.base import Effect, Signals

# By how much a shape is changed up and down, pass after pass.
_RATIOS = (1.35, 1.15, 1.06, 1.025, 1.01)
_LEVELS = (1.05, 1.02, 1.008, 1.003, 1.001)  # of a cut-off level, which is seen directly
_CYCLES = (0.35, 0.15, 0.06, 0.025, 0.01)  # of a ripple, over the travelled range
_FIXED = ("power", "direction")


def shapes_around(effect: Effect, attempt: int, signals: Sequence[Signals]) -> list[dict]:
    """The effect's shape and neighbours of it, one parameter changed at a time."""
    step = min(attempt, len(_RATIOS) - 1)
    found = [dict(effect.shape)]
    for name, value in effect.shape.items():
        if name in _FIXED:
            continue
        if name == "periods":
            j = effect.joints[0]
            low = min(float(s.q[:, j].min()) for s in signals)
            high = max(float(s.q[:, j].max()) for s in signals)
            change = 2 * np.pi * _CYCLES[step] / max(high - low, 1e-6)
            others = [value - change, value + change]
        elif name in ("start", "end"):
            width = abs(effect.shape["end"] - effect.shape["start"])
            change = (_RATIOS[step] - 1.0) * max(width, 0.05)
            others = [value - change, value + change]
        else:
            ratio = (_LEVELS if name == "level" else _RATIOS)[step]
            others = [value / ratio, value * ratio]
        found += [{**effect.shape, name: float(other)} for other in others]
    return found
