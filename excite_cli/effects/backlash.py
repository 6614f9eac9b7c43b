"""Play in a gear: while the motor crosses it, the load is not carried; then the flanks meet.

When the rigid-body torque of the joint changes sign, the link leaves its flank and flies freely.
With the load computed from the motor's motion, the angle δ between motor and link follows

    M_jj δ'' = load_j,    δ = δ' = 0 at the change of sign,

until δ has crossed the gap, or come back. Up to then the motor lacks the load; what the link has
lost in momentum meanwhile, it is given back by the impact:

    −load_j in flight,    +∫ load_j dt over the flight, as a blow at its end.

The link is accelerated by as much over M_jj, and what its motion asks of joint r changes by M_rj
times that. Between flights the link stands half a gap behind the motor, on the side of its load:

    −gap/2 · sgn(load_j) · ∂τ_r/∂q_j.

The blow lasts a moment here; it is the parallel filter that gives it the width it has in the
data. The rotor does not enter: its own motion is measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.ndimage import gaussian_filter1d

from excite_cli.effects.base import Effect, Parameter, Signals
from excite_cli.robot.model import Array, Robot

_GAPS = 1e-3, 3e-2  # rad
_WIDTH = 0.01  # s, of a blow in the search, about that of a filter of 20 Hz
_FINE = 2e-3  # s, the step in which flights are followed
_CHUNK = 256  # samples that are looked at first for the end of a flight


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
        """The gap whose flights and blows, smoothed a little, explain most of the residuals."""
        if not any(len(s.t) > 2 for s in signals):
            return []
        r = np.concatenate(residuals)
        weights = 1.0 / np.maximum(np.mean(r**2, axis=0), 1e-300)
        motions = [_Motion.of(s, joints[0]) for s in signals]

        def energy(gap: float) -> float:
            column = np.concatenate(
                [_smooth(motion.column(gap), s) for motion, s in zip(motions, signals, strict=True)]
            )
            fitted = max(float(np.sum(weights * column * r)), 0.0)  # a negative share is no play
            return fitted**2 / (float(np.sum(weights * column**2)) + 1e-300)

        gaps = np.geomspace(*_GAPS, 48)
        best = gaps[int(np.argmax([energy(gap) for gap in gaps]))]
        near = best * np.geomspace(0.93, 1.07, 21)
        return [{"gap": float(near[int(np.argmax([energy(gap) for gap in near]))])}]

    def rows(self, n: int) -> tuple[int, ...]:
        """All joints."""
        return tuple(range(n))

    def columns(self, signals: Signals) -> Array:
        """Flights, blows, and the shift of the link, in all rows, (T, n, 1)."""
        return _Motion.of(signals, self.joints[0]).column(self.shape["gap"])[:, :, None]


@dataclass(frozen=True)
class _Motion:
    """What of a motion does not depend on the gap.

    `load` and `flights` are on a grid that is `finer` times as fine, since flights last a few
    samples only. `pull` (T, n) is M_rj / M_jj, `slope` (T, n) is ∂τ_r/∂q_j.
    """

    load: Array
    flights: "Flights"
    finer: int
    pull: Array
    slope: Array

    @classmethod
    def of(cls, signals: Signals, j: int) -> "_Motion":
        load = signals.load[:, j]
        if len(load) < 3:
            zero = np.zeros_like(signals.q)
            nothing = np.zeros(len(load))
            return cls(nothing, Flights(nothing, 1.0), 1, zero, zero)
        step = float(signals.t[1] - signals.t[0])
        finer = max(1, int(np.ceil(step / _FINE)))
        inertia = np.maximum(signals.body.mass[:, j, j], 1e-12)
        at, samples = np.arange((len(load) - 1) * finer + 1) / finer, np.arange(len(load))
        fine = np.interp(at, samples, load)
        return cls(
            fine,
            Flights(fine / np.interp(at, samples, inertia), step / finer),
            finer,
            signals.body.mass[:, :, j] / inertia[:, None],
            signals.body.by_position[:, :, j],
        )

    def column(self, gap: float) -> Array:
        """The effect (T, n) of a gap [rad]."""
        lost, behind = np.zeros(len(self.load)), 0.5 * gap * np.sign(self.load)
        for first, last, closed in self.flights.across(gap):
            lost[first:last] = -self.load[first:last]
            behind[first:last] = 0.0
            if closed:
                lost[last] += self.load[first:last].sum()
        lost, behind = _averaged(lost, self.finer), _averaged(behind, self.finer)
        return np.asarray(self.pull * lost[:, None] - self.slope * behind[:, None])


def _averaged(x: Array, finer: int) -> Array:
    """Means over the samples' own intervals, of values on a grid that is `finer` times as fine."""
    half = finer // 2
    padded = np.zeros(len(x) + finer - 1)
    padded[half : half + len(x)] = x
    means = padded.reshape(-1, finer).sum(axis=1)
    means[1:-1] /= finer
    means[0] /= finer - half  # at the ends, half of the interval lies outside
    means[-1] /= half + 1
    return np.asarray(means)


def _smooth(column: Array, signals: Signals) -> Array:
    if len(signals.t) < 3:
        return column
    width = _WIDTH / float(signals.t[1] - signals.t[0])
    smooth: Array = gaussian_filter1d(column, width, axis=0)
    return smooth


class Flights:
    """Flights of a link across gaps of any size.

    Parameters
    ----------
    acceleration: (T,) δ'' of the angle between motor and link, in flight [rad/s²]
    step: [s]
    """

    def __init__(self, acceleration: Array, step: float) -> None:
        self._acceleration, self._step = acceleration, step
        negative = acceleration < 0
        self._changes = np.flatnonzero(negative[1:] != negative[:-1]) + 1
        self._paths: dict[int, Array] = {}

    def across(self, gap: float) -> list[tuple[int, int, bool]]:
        """First sample of each flight, first one after it, and whether a flank was met."""
        count, found, k = len(self._acceleration), [], 0
        while k < len(self._changes):
            first = int(self._changes[k])
            last, closed = self._end(first, gap)
            found.append((first, last, closed))
            if last >= count:
                break
            k = int(np.searchsorted(self._changes, last, side="right"))
        return found

    def _end(self, first: int, gap: float) -> tuple[int, bool]:
        """The first sample at a flank again; the end of the run if there is none."""
        farthest = self._path(first, gap)
        end = first + int(np.searchsorted(farthest, gap)) + 1
        count = len(self._acceleration)
        return (end, True) if end < count and end <= first + len(farthest) else (count, False)

    def _path(self, first: int, gap: float) -> Array:
        """How far the link has been from its flank, until it is back (∞) or beyond the gap."""
        known = self._paths.get(first)
        count = len(self._acceleration)
        while known is None or (known[-1] < gap and first + len(known) < count):
            size = _CHUNK if known is None else 4 * len(known)
            part = self._acceleration[first : first + size]
            side = -1.0 if part[0] < 0 else 1.0
            crossed = np.cumsum(np.cumsum(side * part)) * self._step**2
            back = np.flatnonzero(crossed < 0.0)
            known = np.maximum.accumulate(crossed[: back[0]] if len(back) else crossed)
            if len(back):
                known = np.append(known, np.inf)
            self._paths[first] = known
        return known
