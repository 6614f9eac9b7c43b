"""Curves of a joint's angle without a name, over the way that was travelled."""

from collections.abc import Sequence

import numpy as np

from excite_cli.effects.signals import Signals
from excite_cli.robot.model import Array

_HIGHEST = 4
_HATS = 8


def way_travelled(joint: int, every: Sequence[Signals]) -> tuple[float, float]:
    """Least and greatest angle of the joint in all parts of the data [rad or m]."""
    return (
        min(float(s.q[:, joint].min()) for s in every),
        max(float(s.q[:, joint].max()) for s in every),
    )


def powers_of_angle(joint: int, signals: Signals, every: Sequence[Signals]) -> Array:
    """Powers 0 to 4 of the angle, which runs from −1 to 1 over the way, (T, 5)."""
    return _share(joint, signals, every)[:, None] ** np.arange(_HIGHEST + 1)


def hats_over_angle(joint: int, signals: Signals, every: Sequence[Signals]) -> Array:
    """Eight hats side by side, which add up to 1 everywhere, (T, 8)."""
    at = (_share(joint, signals, every) + 1.0) / 2.0 * (_HATS - 1)
    return np.asarray(np.maximum(1.0 - np.abs(at[:, None] - np.arange(_HATS)), 0.0))


def _share(joint: int, signals: Signals, every: Sequence[Signals]) -> Array:
    low, high = way_travelled(joint, every)
    return np.asarray((2 * signals.q[:, joint] - low - high) / max(high - low, 1e-12))
