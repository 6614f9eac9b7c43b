"""The history of a quantity (hysteresis), by play operators.

A play operator of half-width r follows x only once x has moved r past it. x less what it shows is
the part within the play: it runs into ±r and stays there until x turns round. Sums of such parts
are the hystereses that do not depend on speed (Prandtl and Ishlinskii).
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.robot.model import Array
from excite_cli.workers.at_hand import each
from excite_cli.workers.base import Tell

_WIDTHS = (0.05, 0.15, 0.4)  # of the amplitude


def histories(signals: Sequence[Array]) -> list[Array]:
    """Parts within plays of three widths, (T, n, 3) for each x (T, n); widths are common to all."""
    low = np.min([x.min(axis=0) for x in signals], axis=0)
    high = np.max([x.max(axis=0) for x in signals], axis=0)
    radii = 0.5 * (high - low)[:, None] * np.array(_WIDTHS)
    return list(each(_within_play, radii, signals))


def _within_play(radii: Array, x: Array, tell: Tell) -> Array:
    """x − play(x), (T, n, widths), from the middle of the play."""
    shown = np.empty((*x.shape, radii.shape[1]))
    now = np.repeat(x[0][:, None], radii.shape[1], axis=1)
    for k, value in enumerate(x[:, :, None]):
        now = np.minimum(np.maximum(now, value - radii), value + radii)
        shown[k] = now
    return np.asarray(x[:, :, None] - shown)
