"""Margins of a motion by a second computation, which shares nothing with the first.

The second way (Pinocchio and coal for distances of capsules) takes an instant at a time, so it is
asked at some instants only: evenly spread ones, and those where the first way finds the least.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Array, Constraint
from excite_cli.proof.certificate import Path
from excite_cli.proof.worst_margin import Worst

TOLERANCE = 1e-6
"""By how much, in the unit of the margin, two computations may differ."""
_EVEN, _LOWEST = 250, 250


@dataclass(frozen=True)
class SecondPath:
    """What the second computation gave for one constraint: its worst margin, and how far it is off.

    instants: how many of all `of` instants were compared, in every column. difference: the largest,
    in `unit`, where and when [s] it is.
    """

    name: str
    worst: Worst
    instants: int
    of: int
    difference: float
    unit: str
    label: str
    time: float

    @property
    def agrees(self) -> bool:
        """Whether the two computations give the same."""
        return self.difference <= TOLERANCE


def second_paths(
    constraints: Sequence[Constraint], path: Path, times: Array, least: Sequence[Array]
) -> tuple[SecondPath, ...]:
    """For every constraint that has a second way.

    least: the smallest margins (T,) of each, as shares of their scales, by the first way.
    """
    found = (_compared(*each, path, times) for each in zip(constraints, least, strict=True))
    return tuple(each for each in found if each is not None)


def _compared(constraint: Constraint, least: Array, path: Path, times: Array) -> SecondPath | None:
    even = np.linspace(0, len(times) - 1, min(_EVEN, len(times))).astype(int)
    chosen = np.union1d(even, np.argsort(least, kind="stable")[:_LOWEST])
    states = path.states_at(times[chosen])
    second = constraint.independent_margins(states)
    if second is None:
        return None
    off = np.abs(second - constraint.margins(states))
    off[~np.isfinite(off)] = np.inf
    t, column = divmod(int(np.argmax(off)), off.shape[1])
    return SecondPath(
        name=constraint.name,
        worst=constraint.worst(second, times[chosen]),
        instants=len(chosen),
        of=len(times),
        difference=float(off[t, column]),
        unit=constraint.unit_of(column),
        label=constraint.labels[column],
        time=float(times[chosen[t]]),
    )
