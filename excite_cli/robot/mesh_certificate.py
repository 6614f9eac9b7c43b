"""Proof that meshes stay apart between samples: intervals of time, halved until each is proved."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.mesh_check import MeshCheck

Array = NDArray[np.float64]
Positions = Callable[[Array], Array]
Change = Callable[[Array, float], Array]

_COARSEST = 0.016  # [s]


@dataclass(frozen=True)
class UnprovedGap:
    """Two links whose meshes are not proved apart around `time` [s].

    broken: they touch (or are within the margin) there; else no interval down to the shortest was
    short enough, and `distance` [m] is what is kept for sure, or less than zero.
    """

    first: str
    second: str
    time: float
    distance: float
    broken: bool


@dataclass(frozen=True)
class MeshCertificate:
    """Whether all judged pairs stay apart at every instant.

    intervals: how many (interval, pair) were looked at; shortest: the shortest interval needed
    [s]; gaps: the pairs not proved, at the first instant of each.
    """

    intervals: int
    shortest: float
    gaps: tuple[UnprovedGap, ...]

    @property
    def proved(self) -> bool:
        """Whether no pair is left."""
        return not self.gaps

    @property
    def broken(self) -> bool:
        """Whether meshes were found to touch."""
        return any(gap.broken for gap in self.gaps)


def certify_meshes(
    check: MeshCheck,
    positions: Positions,
    change: Change,
    duration: float,
    margin: float = 0.0,
    shortest: float = 1e-5,
) -> MeshCertificate:
    """Prove that all judged pairs stay more than `margin` [m] apart from 0 to `duration` [s].

    positions(t (K,)) → q (K, n); change(t, half) → (K, n): how far each joint can be from q(t) at
    any instant within `half` [s] of t. Intervals that are not proved are halved, for the pairs
    concerned only, until they are shorter than `shortest` [s].
    """
    count = max(1, int(np.ceil(duration / _COARSEST)))
    half = float(duration / count / 2)
    times: Array = np.linspace(half, duration - half, count)
    asked = np.ones((count, len(check.judged)), dtype=bool)
    looked_at, gaps = 0, dict[int, UnprovedGap]()
    while True:
        proof = check.proved(
            positions(times), change=change(times, half), margin=margin, asked=asked
        )
        looked_at += int(asked.sum())
        left = asked & ~proof.proved
        last = 2 * half < shortest
        for p in np.flatnonzero((proof.broken | (left & last)).any(axis=0)).tolist():
            k = int(np.flatnonzero(proof.broken[:, p] | (left[:, p] & last))[0])
            found = UnprovedGap(
                *check.names(check.judged[p]),
                time=float(times[k]),
                distance=float(proof.distance[k, p]),
                broken=bool(proof.broken[k, p]),
            )
            if p not in gaps or (found.broken and not gaps[p].broken):
                gaps[p] = found
        # A pair that touches is not looked at any more.
        left[:, [p for p, gap in gaps.items() if gap.broken]] = False
        again = np.flatnonzero(left.any(axis=1))
        if last or not len(again):
            break
        half /= 2
        times = np.asarray(times[again][:, None] + half * np.array([-1.0, 1.0])).ravel()
        asked = np.repeat(left[again], 2, axis=0)
    ordered = tuple(sorted(gaps.values(), key=lambda gap: gap.time))
    return MeshCertificate(looked_at, 2 * half, ordered)
