"""Backlash of a gear: while the motor crosses it, the load is not carried; then the flanks meet.

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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from excite_cli.effects.base import Effect, Parameter, Signals, Tier
from excite_cli.effects.mechanism import real
from excite_cli.effects.parameter import whole_share
from excite_cli.effects.simulated_robot import SimulatedRobot, Transmission, rotor_inertia
from excite_cli.robot.model import Array, Robot

_GAPS = 1e-3, 3e-2  # rad
_MISSED = 0.04  # of the share, one standard deviation; measured on simulated arms
_WIDTH = 0.01  # s, of a blow in the search, about that of a filter of 20 Hz
_FINE = 2e-3  # s, the step in which flights are followed
_CHUNK = 256  # samples that are looked at first for the end of a flight
_NOTHING = 1e-12  # of the residual energy
_PORTION = 2**17  # values of columns that are searched at once
# Samples in which the gap is searched, the middles of all parts: minutes at 50 to 100 Hz. What is
# found there is tested on all of them, and changed by `finer_steps`.
_SEARCHED = 20_000


class Backlash(Effect):
    """`share` (1: a clean gap) of the load that a gap of `gap` rad takes away and gives back."""

    kind: ClassVar = "backlash"
    over_time: ClassVar = True
    title: ClassVar = "backlash of the gear"
    signature: ClassVar = "when the load changes sign it is missing for a while, then comes a blow"
    in_all_rows: ClassVar = True
    parameters: ClassVar = (whole_share("share"),)
    shapes: ClassVar = (Parameter("gap", "rad", *_GAPS),)
    finer_ratios: ClassVar = (1.15, 1.06, 1.02, 1.007)  # a flight more or less changes much
    tier: ClassVar = Tier.LAST
    excludes: ClassVar = ("elasticity",)  # which it is, with a dead zone
    known_by: ClassVar = "gap"
    settings: ClassVar[Mapping[str, float]] = {"rotor_inertia": 0.0}
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
        signals, residuals = _searched(signals, residuals)
        energy = np.mean(np.concatenate(residuals) ** 2, axis=0)
        # Of joints with nothing left, rounding is no evidence of a gap.
        weights = 1.0 / np.maximum(energy, _NOTHING * energy.max() + 1e-100)
        motions = [_Motion.of(s, joints[0]) for s in signals]

        def best(gaps: Array) -> float:
            product, square = np.zeros(len(gaps)), np.zeros(len(gaps))
            for motion, s, left in zip(motions, signals, residuals, strict=True):
                for some in _few(len(gaps), left.size):
                    columns = _smooth(motion.columns(gaps[some]), s)
                    product[some] += np.einsum("gtr,tr->g", columns, left * weights)
                    square[some] += np.einsum("gtr,gtr->gr", columns, columns) @ weights
            fitted = np.maximum(product, 0.0)  # a negative share is no backlash
            return float(gaps[int(np.argmax(fitted / np.sqrt(square + 1e-300)))])

        return [{"gap": best(best(np.geomspace(*_GAPS, 48)) * np.geomspace(0.93, 1.07, 21))}]

    def model_error(self, values: Array) -> Array:
        """What the unknown way in which flanks meet makes of the share."""
        return _MISSED * values

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A rotor and a link that is free between two stops."""
        given = numbers["rotor_inertia"]
        for j in self.joints:
            rotor = rotor_inertia(robot, j, given)
            robot.soft[j] = Transmission(rotor, given > 0.0, play=numbers["gap"])

    def columns(self, signals: Signals) -> Array:
        """Flights, blows, and the shift of the link, in all rows, (T, n, 1)."""
        gaps = np.array([self.shape["gap"]])
        return _Motion.of(signals, self.joints[0]).columns(gaps)[0][:, :, None]

    def in_c_series(self, values: Array) -> str:
        """Flights and blows of a whole series; a controller cannot know them in time."""
        j, numbers = self.joints[0], (self.shape["gap"], float(values[0]), _FINE)
        told = ", ".join(map(real, numbers))
        return f"backlash(count, step, q, v, a, load, {j}, {told}, torque, spare);"


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

    def columns(self, gaps: Array) -> Array:
        """The effect (G, T, n) of gaps [rad]."""
        load, count = self.load, len(self.load)
        turns, lost = np.zeros((len(gaps), count + 1), dtype=np.int8), np.zeros((len(gaps), count))
        for g, flights in enumerate(self.flights.across(gaps)):
            for first, last, closed in flights:
                turns[g, first], turns[g, last] = 1, -1
                if closed:
                    lost[g, last] = load[first:last].sum()
        flying = np.cumsum(turns[:, :-1], axis=1, dtype=np.int8).astype(bool)
        lost = _averaged(np.where(flying, -load, lost), self.finer)
        behind = 0.5 * gaps[:, None] * np.sign(load)
        behind = _averaged(np.where(flying, 0.0, behind), self.finer)
        return np.asarray(self.pull * lost[:, :, None] - self.slope * behind[:, :, None])


def _searched(
    signals: Sequence[Signals], residuals: Sequence[Array]
) -> tuple[Sequence[Signals], Sequence[Array]]:
    """The middles of all parts: of each the share that `_SEARCHED` is of them all."""
    share = _SEARCHED / max(sum(len(s.t) for s in signals), 1)
    if share >= 1.0:
        return signals, residuals
    middles = []
    for s in signals:
        size = max(round(share * len(s.t)), 3)
        first = max(len(s.t) - size, 0) // 2
        middles.append(slice(first, first + size))
    pairs = list(zip(middles, signals, residuals, strict=True))
    return [s.cut(at) for at, s, _ in pairs], [left[at] for at, _, left in pairs]


def _few(count: int, size: int) -> list[slice]:
    """`count` gaps in portions whose columns of `size` values each fit into a cache."""
    step = max(1, _PORTION // max(size, 1))
    return [slice(at, at + step) for at in range(0, count, step)]


def _averaged(x: Array, finer: int) -> Array:
    """Means over the samples' own intervals, of (G, T') on a grid that is `finer` times as fine."""
    half = finer // 2
    padded = np.zeros((len(x), x.shape[1] + finer - 1))
    padded[:, half : half + x.shape[1]] = x
    means = padded.reshape(len(x), -1, finer).sum(axis=2)
    means[:, 1:-1] /= finer
    means[:, 0] /= finer - half  # at the ends, half of the interval lies outside
    means[:, -1] /= half + 1
    return np.asarray(means)


def _smooth(columns: Array, signals: Signals) -> Array:
    """Columns (G, T, n), smoothed over time."""
    if len(signals.t) < 3:
        return columns
    width = _WIDTH / float(signals.t[1] - signals.t[0])
    smooth: Array = gaussian_filter1d(columns, width, axis=1)
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

    def across(self, gaps: Array) -> list[list[tuple[int, int, bool]]]:
        """Flights of each gap: first sample, first one after it, and whether a flank was met.

        Flights that begin at the same change of sign share their path, whatever the gap.
        """
        starts = self._changes.tolist()
        found: list[list[tuple[int, int, bool]]] = [[] for _ in gaps]
        waiting: dict[int, list[NDArray[np.intp]]] = {0: [np.arange(len(gaps))]}
        for k, first in enumerate(starts):
            if k not in waiting:
                continue
            own = np.concatenate(waiting.pop(k))
            last, closed = self._ends(first, gaps[own])
            following = np.searchsorted(self._changes, last, side="right")
            for g, end, met in zip(own.tolist(), last.tolist(), closed.tolist(), strict=True):
                found[g].append((first, end, met))
            for later in np.unique(following):
                waiting.setdefault(int(later), []).append(own[following == later])
        return found

    def _ends(self, first: int, gaps: Array) -> tuple[Array, NDArray[np.bool_]]:
        """The first sample at a flank again; the end of the run if there is none."""
        farthest = self._path(first, float(gaps.max()))
        end, count = first + np.searchsorted(farthest, gaps) + 1, len(self._acceleration)
        closed = (end < count) & (end <= first + len(farthest))
        return np.where(closed, end, count), closed

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
