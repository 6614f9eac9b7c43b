"""Play in a gear: while the motor crosses it, the load is not carried; then the flanks meet.

When the rigid-body torque of the joint changes sign, the link leaves its flank and flies freely.
With the load computed from the motor's motion, the angle δ between motor and link follows

    M_jj δ'' = load_j,    δ = δ' = 0 at the change of sign,

until δ has crossed the gap, or come back. Up to then the motor lacks the load; what the link has
lost in momentum meanwhile, it is given back by the impact:

    −load_j in flight,    +∫ load_j dt over the flight, as a blow at its end.

The blow lasts one sample here; it is the parallel filter that gives it the width it has in the
data. The rotor does not enter: its own motion is measured.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from scipy.ndimage import gaussian_filter1d

from excite_cli.effects.base import Effect, Parameter, Signals
from excite_cli.robot.model import Array, Robot

_GAPS = 1e-3, 3e-2  # rad
_WIDTH = 0.01  # s, of a blow in the search, about that of a filter of 20 Hz
_CHUNK = 64  # samples that are looked at first for the end of a flight


class Backlash(Effect):
    """`share` (1: clean play) of the load that a gap of `gap` rad takes away and gives back."""

    kind: ClassVar = "backlash"
    title: ClassVar = "play in the gear (backlash)"
    signature: ClassVar = "when the load changes sign it is missing for a while, then comes a blow"
    parameters: ClassVar = (Parameter("share", "1", 0.3, 1.5, nonnegative=True),)
    shapes: ClassVar = (Parameter("gap", "rad", *_GAPS),)
    excitable: ClassVar = False
    why_not_excitable: ClassVar = "samples enter and leave the gap by jumps; there is no gradient"

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Twelve gaps from 1 to 30 mrad; those in between overlap with them."""
        return [{"gap": float(gap)} for gap in np.geomspace(*_GAPS, 12)]

    @classmethod
    def tuned(
        cls,
        robot: Robot,
        joints: tuple[int, ...],
        signals: Sequence[Signals],
        residuals: Sequence[Array],
    ) -> list[dict]:
        """The gap whose flights and blows, smoothed a little, explain most of the residual."""
        if not any(len(s.t) > 2 for s in signals):
            return []
        r = np.concatenate([np.asarray(x)[:, joints[0]] for x in residuals])

        def energy(gap: float) -> float:
            effect = cls(joints, {"gap": float(gap)})
            column = np.concatenate([_smooth(effect.columns(s)[:, 0, 0], s) for s in signals])
            fitted = max(float(column @ r), 0.0)  # a negative share is no play
            return fitted**2 / (float(column @ column) + 1e-300)

        gaps = np.geomspace(*_GAPS, 48)
        best = gaps[int(np.argmax([energy(gap) for gap in gaps]))]
        near = best * np.geomspace(0.93, 1.07, 9)
        return [{"gap": float(near[int(np.argmax([energy(gap) for gap in near]))])}]

    def columns(self, signals: Signals) -> Array:
        """−load_j in flight, the blow at its end, else zero, (T, 1, 1)."""
        j, column = self.joints[0], np.zeros(len(signals.t))
        if len(signals.t) > 2:
            load, step = signals.load[:, j], float(signals.t[1] - signals.t[0])
            inertia = np.maximum(signals.body.mass[:, j, j], 1e-12)
            for first, last, closed in flights(load / inertia, self.shape["gap"], step):
                column[first:last] = -load[first:last]
                if closed:
                    column[last] += load[first:last].sum()
        return column[:, None, None]


def _smooth(column: Array, signals: Signals) -> Array:
    if len(signals.t) < 3:
        return column
    width = _WIDTH / float(signals.t[1] - signals.t[0])
    smooth: Array = gaussian_filter1d(column, width)
    return smooth


def flights(acceleration: Array, gap: float, step: float) -> list[tuple[int, int, bool]]:
    """Flights across a gap: first sample, first one after it, and whether a flank was met.

    Parameters
    ----------
    acceleration: (T,) δ'' of the angle between motor and link, in flight [rad/s²]
    gap: [rad]
    step: [s]
    """
    negative = acceleration < 0
    changes = np.flatnonzero(negative[1:] != negative[:-1]) + 1
    count, found, k = len(acceleration), [], 0
    while k < len(changes):
        first = int(changes[k])
        last, closed = _end(acceleration, first, gap, step)
        found.append((first, last, closed))
        k = int(np.searchsorted(changes, last, side="right")) if last < count else len(changes)
    return found


def _end(acceleration: Array, first: int, gap: float, step: float) -> tuple[int, bool]:
    """The first sample at a flank again; the end of the run if there is none."""
    side = -1.0 if acceleration[first] < 0 else 1.0
    size, count = _CHUNK, len(acceleration)
    while True:
        part = side * acceleration[first : first + size]
        crossed = np.cumsum(np.cumsum(part)) * step**2
        at_flank = np.flatnonzero((crossed >= gap) | (crossed < 0.0))
        if len(at_flank):
            end = first + int(at_flank[0]) + 1
            return (end, True) if end < count else (count, False)
        if first + size >= count:
            return count, False
        size *= 4
