"""Whether a motion keeps its constraints at every instant: proved, broken, or neither.

Time is cut into intervals of a few milliseconds. Over each, every constraint gives a lower bound on
its margins (`least`), from enclosures of the motion that are computed apart from the
optimiser's kinematics. Where the bound is negative, the instant in the middle is looked at: a
negative margin there breaks the constraint; otherwise the interval is cut in two and looked at
again. The bounds approach the margins with the third power of the width (first power at kinks), so
that whatever has a margin of more than rounding is proved after few cuts.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from excite_cli.arrays import Array, Mask
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.proof.enclosed_motion import (
    EnclosedMotion,
    Intervals,
    enclosed_states,
    intervals_of,
)
from excite_cli.robot.model import Robot
from excite_cli.trajectory.base import Trajectory

# The record of the smallest margin of a constraint over a motion.


@dataclass(frozen=True)
class Worst:
    """The smallest margin of a constraint over a motion, with where and when it occurs.

    Smallest as a `share` of the scale of its column, so that joints of different size compare.
    """

    margin: float
    unit: str
    label: str
    time: float
    violations: int
    share: float = 0.0

    @classmethod
    def of(cls, constraint: "Provable", margins: "Array", times: "Array") -> "Worst":
        """Of margins (T, m) at `times` (T,), and how many are broken."""
        t, column = divmod(int(np.argmin(margins / constraint.scale)), margins.shape[1])
        margin = float(margins[t, column])
        broken = int(np.count_nonzero(margins < -constraint.rounding))
        share = margin / float(constraint.scale[column])
        unit, label = constraint.unit_of(column), constraint.labels[column]
        return cls(margin, unit, label, float(times[t]), broken, share)

    def with_later(self, later: "Worst") -> "Worst":
        """The worse of two, by the share of the scale, with the violations of both."""
        worse = later if later.share < self.share else self
        return replace(worse, violations=self.violations + later.violations)


State = Literal["proved", "sampled", "broken"]

_WIDTH = 0.04  # [s] of the first intervals
_CUTS = 16
_MOST_OPEN = 4000
_CHUNK = 6000  # joints times intervals that are enclosed at once
_LEAST_CHUNK = 200
_TRIFLE = 1e-4  # share of the scale


class Provable(Protocol):
    """What is asked of a constraint to be proved; `constraints.base.Constraint` is one."""

    name: str
    labels: tuple[str, ...]
    scale: Array

    @property
    def rounding(self) -> Array:
        """What a margin may lack at a bound (m,)."""

    def margins(self, states: States) -> Array:
        """Margins (T, m) at instants."""

    def least(self, motion: EnclosedMotion) -> Array | None:
        """Lower bounds (T, m) over intervals, or None where none is known."""

    def unit_of(self, column: int) -> str:
        """Unit of one column."""


@dataclass(frozen=True)
class ProofVerdict:
    """What is known of one constraint along a whole motion.

    `lacking` (m,): by how much each column falls short at the worst instant seen (a trifle where
    that could not be decided), zero where it holds. `label`, `time` and `margin` tell the worst
    instant of a constraint that is not proved, `reason` says in words why it is not; without
    `bounded` no bound between instants is known.
    """

    name: str
    state: State
    lacking: Array
    reason: str = ""
    label: str = ""
    time: float = 0.0
    margin: float = 0.0
    bounded: bool = True

    @property
    def proved(self) -> bool:
        """Whether the constraint holds at every instant."""
        return self.state == "proved"


@dataclass(frozen=True)
class Path:
    """A motion to be judged: `coefficients` (K, n) of `trajectory` for `robot`."""

    robot: Robot
    trajectory: Trajectory
    coefficients: Array
    states_at: Callable[[Array], States]

    def chunks(self, intervals: Intervals) -> Iterator[Intervals]:
        """The intervals in portions: large ones cost less each, very large ones much memory."""
        size = max(_LEAST_CHUNK, _CHUNK // self.robot.n)
        for begin in range(0, len(intervals), size):
            yield intervals.only(slice(begin, begin + size))

    def enclosed(self, intervals: Intervals) -> EnclosedMotion:
        """Everything that can happen in the intervals."""
        states = enclosed_states(self.trajectory, self.coefficients, intervals)
        return EnclosedMotion(self.robot, states)


def certify(path: Path, constraints: Sequence[Provable]) -> tuple[ProofVerdict, ...]:
    """A verdict on every constraint, in their order."""
    intervals = intervals_of(path.trajectory, _WIDTH)
    open_: list[list[Intervals]] = [[] for _ in constraints]
    known = [True] * len(constraints)
    for some in path.chunks(intervals):
        motion = path.enclosed(some)
        for index, constraint in enumerate(constraints):
            least = constraint.least(motion)
            if least is None:
                known[index] = False
                continue
            doubtful = _doubtful(least, constraint)
            if doubtful.any():
                open_[index].append(some.only(doubtful))
    return tuple(
        _settled(path, constraint, open_[index]) if known[index] else _unknown(constraint)
        for index, constraint in enumerate(constraints)
    )


def _doubtful(least: Array, constraint: Provable) -> Mask:
    """Which intervals are not proved; what is not a number proves nothing."""
    return np.asarray(~(least >= -constraint.rounding).all(axis=1))


def _unknown(constraint: Provable) -> ProofVerdict:
    nothing = np.zeros(len(constraint.labels))
    reason = "no bound between instants is known for it"
    return ProofVerdict(constraint.name, "sampled", nothing, reason, bounded=False)


def _settled(path: Path, constraint: Provable, open_: list[Intervals]) -> ProofVerdict:
    """Cut what is open until it is proved, or seen to be broken."""
    lacking = np.zeros(len(constraint.labels))
    seen = _Seen(constraint)
    pending, columns = _joined(open_), np.ones(len(constraint.labels), dtype=bool)
    for _ in range(_CUTS):
        if not len(pending):
            break
        margins = constraint.margins(path.states_at(pending.middles))
        seen.look(margins, pending.middles)
        np.maximum(lacking, -margins.min(axis=0) - constraint.rounding, out=lacking)
        if len(pending) > _MOST_OPEN or (seen.broken and len(pending) * 2 > _MOST_OPEN // 8):
            break
        pending, columns = _still_open(path, constraint, pending.halved())
    if len(pending):
        np.maximum(lacking, np.where(columns, _TRIFLE * constraint.scale, 0.0), out=lacking)
    if seen.broken:
        reason = "a margin is negative"
        return seen.verdict("broken", lacking, reason)
    if len(pending) > _MOST_OPEN:
        return seen.verdict("sampled", lacking, "too many intervals would have to be looked at")
    if len(pending):
        thin = "the margin is too small to be distinguished from zero"
        return seen.verdict("sampled", lacking, thin)
    return ProofVerdict(constraint.name, "proved", lacking)


def _still_open(path: Path, constraint: Provable, intervals: Intervals) -> tuple[Intervals, Mask]:
    """Those of the intervals that are not proved, and in which columns (m,) any is not."""
    keep: list[Intervals] = []
    columns = np.zeros(len(constraint.labels), dtype=bool)
    for some in path.chunks(intervals):
        least = constraint.least(path.enclosed(some))
        assert least is not None, "a bound that was known once is known always"
        keep.append(some.only(_doubtful(least, constraint)))
        columns |= ~(least >= -constraint.rounding).all(axis=0)
    return _joined(keep), columns


class _Seen:
    """The worst instant among those looked at, as a share of its column's scale."""

    def __init__(self, constraint: Provable) -> None:
        self._constraint = constraint
        self._share, self._label, self._time, self._margin = np.inf, "", 0.0, np.inf
        self.broken = False

    def look(self, margins: Array, times: Array) -> None:
        worst = Worst.of(self._constraint, margins, times)
        self.broken |= bool((margins < -self._constraint.rounding).any())
        if worst.share < self._share:
            self._share, self._margin = worst.share, worst.margin
            self._label, self._time = worst.label, worst.time

    def verdict(self, state: State, lacking: Array, reason: str) -> ProofVerdict:
        name = self._constraint.name
        return ProofVerdict(name, state, lacking, reason, self._label, self._time, self._margin)


def _joined(parts: list[Intervals]) -> Intervals:
    if not parts:
        return Intervals(np.zeros(0), np.zeros(0))
    return Intervals(
        np.concatenate([part.middles for part in parts]),
        np.concatenate([part.halves for part in parts]),
    )
