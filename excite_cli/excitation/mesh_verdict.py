"""Whether the true collision meshes stay apart between the instants, too.

Enclosed positions say how far each joint may be from the middle of an interval. Meshes that are
farther apart in the middle than their links can approach each other by that stay apart throughout;
elsewhere the interval is cut in two.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.constraints.base import Array
from excite_cli.geometry.mesh_check import MeshCheck, MeshGap, MeshGaps
from excite_cli.geometry.reasons import ContactMeaning
from excite_cli.proof.certificate import Path, State, Worst
from excite_cli.proof.enclosed_trajectory import Intervals, enclosed_states, intervals_of

Mask = NDArray[np.bool_]

_WIDTH = 0.02  # [s]
_CUTS = 10
_MOST_OPEN = 2000
_CHUNK = 200


@dataclass(frozen=True)
class MeshVerdict:
    """What is known of the meshes along a motion; `times` (T,) are the instants of `gaps`."""

    state: State
    reason: str
    gaps: MeshGaps
    times: Array

    @property
    def proved(self) -> bool:
        """Whether no judged pair touches at any instant."""
        return self.state == "proved"

    def worst(self) -> Worst:
        """The nearest judged pair; a bound for all where none came near."""
        judged = [gap for gap in self.gaps.near if gap.standing is ContactMeaning.JUDGED]
        if not judged:
            return Worst(self.gaps.beyond, "m", "all pairs farther", float(self.times[0]), 0)
        nearest = judged[0]
        broken = sum(gap.touching for gap in judged)
        distance = -1e-9 if nearest.touching and nearest.distance >= 0 else nearest.distance
        words = f"{nearest.first} – {nearest.second}"
        return Worst(distance, "m", words, float(self.times[nearest.index]), broken, distance)

    @property
    def told(self) -> tuple[MeshGap, ...]:
        """Pairs that touch and are not judged, with the reason in `standing`."""
        return tuple(
            gap
            for gap in self.gaps.near
            if gap.standing is not ContactMeaning.JUDGED and gap.touching
        )


def mesh_verdict(path: Path, check: MeshCheck, times: Array) -> MeshVerdict:
    """Meshes at `times` (T,) [s], and between them."""
    gaps = check.least(path.states_at(times).q)
    if gaps.broken:
        return MeshVerdict("broken", "meshes touch", gaps, times)
    pending = intervals_of(path.trajectory, _WIDTH)
    asked = np.ones((len(pending), len(check.judged)), dtype=bool)
    for _ in range(_CUTS):
        pending, asked, broken = _open(path, check, pending, asked)
        if broken:
            return MeshVerdict("broken", "meshes touch between the instants", gaps, times)
        if not len(pending):
            return MeshVerdict("proved", "", gaps, times)
        if len(pending) > _MOST_OPEN:
            break
        pending, asked = pending.halved(), np.tile(asked, (2, 1))
    reason = "the meshes come too near to each other for a proof between the instants"
    return MeshVerdict("sampled", reason, gaps, times)


def _open(
    path: Path, check: MeshCheck, intervals: Intervals, asked: Mask
) -> tuple[Intervals, Mask, bool]:
    """Intervals with pairs that are not proved apart, which pairs, and whether any touch."""
    left, broken = np.zeros_like(asked), False
    for begin in range(0, len(intervals), _CHUNK):
        some = slice(begin, begin + _CHUNK)
        q = enclosed_states(path.trajectory, path.coefficients, intervals.only(some)).q
        proof = check.proved(q.center, change=q.reach, asked=asked[some])
        left[some] = asked[some] & ~proof.proved
        broken |= bool(proof.broken.any())
    again = np.asarray(left.any(axis=1))
    return intervals.only(again), left[again], broken
