"""From a motion to what a robot can play: entry from its posture, periods, return to rest.

The motion is entered from rest at the robot's posture in the first of these ways that is admissible
as a whole:

1. one polynomial of degree five to the state of the motion at its first instant, from the posture
   itself, or from another one near the motion to which the robot goes first (behind it, to gather
   speed, its mean, its first posture, robot.posture);
2. a periodic motion swells over some periods from rest at such a posture (`Fade`).

Between postures it goes straight, or along a path around what is in between; this is all there is
to do where the motion starts at rest.

The return is the same at the other end. Segments join with continuous q, v and a.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.constraints.base import Array, Constraint
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.base_motion import require_clear
from excite_cli.excitation.connection import (
    Judge,
    State,
    joined_states,
    judge_of,
    resting_way,
)
from excite_cli.excitation.path_search import standing_margins
from excite_cli.excitation.problem import Problem
from excite_cli.proof.enclosed_motion import Intervals, enclosed_states, intervals_of
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fade import Chain, Fade, Segment
from excite_cli.trajectory.fourier import FourierTrajectory

_FADE_PERIODS = (1, 2, 3)
_RUN_UPS = (0.2, 0.4, 0.7, 1.1, 1.6, 2.4)  # [s]
_OFF_LIMIT = 1e-3  # [rad, m]
_INSTANTS = 50
_CLOSED = 1e-9


def program(
    problem: Problem,
    motion: Segment,
    posture: Array,
    periods: int = 1,
    with_return: bool = True,
    judge: Judge | None = None,
) -> Chain:
    """The chain [entry, motion × periods, return] from rest at `posture` (n,) and back to it.

    The motion is played as it is; entry and return are admissible by `judge`, by default as the
    problem's motions are (certificates, or 1 kHz). Their segments are named `entry` and `return`;
    there may be several of each, and none where the motion starts (ends) at rest at the posture.

    Raises
    ------
    NoAdmissibleMotionError
        The posture breaks a constraint, or no admissible entry or return was found.
    ConfigError
        Several periods of a motion that does not end as it begins.
    """
    require_clear(problem, posture, "the posture of the entry (--from, else robot.posture)")
    if periods > 1:
        _require_closed(motion)
    judge = judge or judge_of(problem)
    segments = [*_Link(problem, motion, judge, True).segments(posture), *[motion] * periods]
    if with_return:
        segments += _Link(problem, motion, judge, False).segments(posture)
    return Chain(tuple(segments))


@dataclass(frozen=True)
class _Link:
    """The entry into a motion, or the return from it."""

    problem: Problem
    motion: Segment
    judge: Judge
    entering: bool

    @property
    def name(self) -> str:
        return "entry" if self.entering else "return"

    @property
    def state(self) -> State:
        """That of the motion where it is entered or left."""
        trajectory = self.motion.trajectory
        time = 0.0 if self.entering else trajectory.duration
        return State.of(trajectory, self.motion.coefficients, time)

    def segments(self, posture: Array) -> list[Segment]:
        """In the order in which they are played."""
        state = self.state
        if state.at_rest:
            try:
                return self.way(posture, state.q)
            except NoAdmissibleMotionError as error:
                raise self.failure(str(error)) from error
        reasons = []
        for anchor, landed, reason in self.landings(posture, state):
            if landed is None:
                reasons.append(reason)
                continue
            try:
                way = self.way(posture, anchor)
            except NoAdmissibleMotionError as error:
                # The anchor is connected to the motion: other anchors would not help.
                raise self.failure(str(error)) from error
            return [*way, landed] if self.entering else [landed, *way]
        raise self.failure(reasons[0])

    def landings(self, posture: Array, state: State) -> Iterator[tuple[Array, Segment | None, str]]:
        """Anchors with a segment between rest there and the motion, or None and why not."""
        anchors = list(self.anchors(posture))
        yield anchors[0], *self.joined(anchors[0], state)
        for anchor in self.run_ups(state):
            yield anchor, *self.joined(anchor, state)
        for anchor in anchors[1:]:
            yield anchor, *self.joined(anchor, state)
        for anchor in anchors:
            yield anchor, *self.faded(anchor)

    def way(self, posture: Array, anchor: Array) -> list[Segment]:
        """Between the robot's posture and `anchor`, both at rest."""
        ends = (posture, anchor) if self.entering else (anchor, posture)
        seed = self.problem.spec.seed
        return resting_way(self.problem, self.judge, self.name, ends, seed)

    def anchors(self, posture: Array) -> Iterator[Array]:
        """Postures from which the motion may be entered; those that are not clear are left out."""
        trajectory = self.motion.trajectory
        times = np.linspace(0.0, trajectory.duration, _INSTANTS, endpoint=False)
        q, _, _ = trajectory.states(times, self.motion.coefficients)
        yield posture
        for other in (q.mean(axis=0), self.state.q, self.problem.robot.posture):
            if self.is_clear(other):
                yield other

    def run_ups(self, state: State) -> Iterator[Array]:
        """Clear postures from which speed is gathered evenly in some time T (or lost again).

        q − v T/2 + a T²/12, kept within the limits of joints: there v has no turn on the way.
        """
        limits = self.problem.robot.limits
        for duration in _RUN_UPS:
            back = state.v * duration / 2
            anchor = state.q + (-back if self.entering else back) + state.a * duration**2 / 12
            anchor = np.clip(anchor, limits.lower + _OFF_LIMIT, limits.upper - _OFF_LIMIT)
            if self.is_clear(anchor):
                yield anchor

    def is_clear(self, posture: Array) -> bool:
        """Whether standing there keeps all constraints."""
        margins = standing_margins(self.problem, posture[None])
        return all(margin.min() > 0 for margin in margins)

    def joined(self, anchor: Array, state: State) -> tuple[Segment | None, str]:
        """A polynomial between rest at `anchor` and the motion, or None and why not."""
        ends = (State.resting(anchor), state)
        try:
            first, last = ends if self.entering else ends[::-1]
            return joined_states(self.problem, self.judge, self.name, first, last), ""
        except NoAdmissibleMotionError as error:
            return None, f"between the posture and the state of the motion, {error}"

    def faded(self, anchor: Array) -> tuple[Segment | None, str]:
        """A periodic motion that swells from `anchor` or dies away to it, or None and why not."""
        reason = "it is not periodic"
        for trajectory in self.fades():
            coefficients = np.vstack([self.motion.coefficients, anchor])
            words = self.judge(trajectory, coefficients)
            if words is None:
                return Segment(self.name, trajectory, coefficients), ""
            reason = f"letting it swell or die away breaks {words}"
        return None, reason

    def fades(self) -> Iterator[Trajectory]:
        """Ways for a periodic motion to swell or to die away."""
        trajectory = self.motion.trajectory
        if isinstance(trajectory, FourierTrajectory):
            for periods in _FADE_PERIODS:
                yield Fade(trajectory, periods, out=not self.entering)

    def failure(self, reason: str) -> NoAdmissibleMotionError:
        """What to tell when nothing works."""
        what = "entry into" if self.entering else "return from"
        return NoAdmissibleMotionError(
            f"No admissible {what} the motion was found: {reason[0].lower()}{reason[1:]}"
            f"{'' if reason.endswith('.') else '.'} Start from another posture, or plan a motion "
            "that starts and ends at rest (trajectory.at_rest) at a posture of your own "
            "(trajectory.start)."
        )


def _require_closed(motion: Segment) -> None:
    trajectory, coefficients = motion.trajectory, motion.coefficients
    first = State.of(trajectory, coefficients, 0.0)
    last = State.of(trajectory, coefficients, trajectory.duration)
    jumps = [np.abs(getattr(last, name) - getattr(first, name)).max() for name in "qva"]
    if max(jumps) > _CLOSED:
        raise ConfigError(
            "periods: the motion does not end as it begins, so it cannot be repeated. Take family "
            "fourier, or give trajectory.start and the same trajectory.end."
        )


# The same path, slower: its derivative of order k falls with the power k of the pace c.
#
# With |x_j(t)| ≤ share·x_max,j required of speeds, accelerations and jerks at every instant,
#
#     c = min(1, min_{k,j} (share·x_max,kj / max_t|x_kj|)^(1/k)),      k = 1, 2, 3
#
# The largest derivatives are bounds over whole intervals of time (Taylor models), so that the
# limits hold between samples too. Torques of rigid bodies, τ = τ_g + c²·(τ₁ − τ_g), lie between
# those of standing still at the same posture, τ_g, and those of the original, τ₁: a slow motion
# can break a bound on torque only where standing still breaks it (or, of a motor that has less
# torque at speed, would break it with that of the motion's speed).

# A share of the limits below which a motion takes hours, and no memory holds its instants.
_LEAST = 1e-3
_INTERVALS = 2000  # in a motion, or one for each of its smooth pieces
_CHUNK = 4000


@dataclass(frozen=True)
class PaceLimits:
    """Largest speed, acceleration and jerk (3, n) of joints, infinite where there is no bound."""

    largest: Array

    @classmethod
    def of(cls, constraints: Sequence[Constraint], n: int) -> "PaceLimits":
        """From the joint bounds among `constraints`; the nearer one where two sides differ."""
        found = np.full((3, n), np.inf)
        for constraint in constraints:
            columns = constraint.linear
            if columns is not None and columns.quantity != Quantity.POSITION:
                np.minimum.at(found[columns.quantity - 1], columns.joints, columns.bounds)
        return cls(found)


def slowing(limits: PaceLimits, trajectory: Trajectory, coefficients: Array, share: float) -> float:
    """The pace c, at most 1, at which derivatives keep `share` of their limits.

    Raises
    ------
    ConfigError
        `share` is not between `_LEAST` and 1, or no joint has a limit.
    """
    if not _LEAST <= share <= 1.0:
        raise ConfigError(f"--slow {share:g}: give a share of the limits from {_LEAST:g} to 1.")
    if not np.isfinite(limits.largest).any():
        raise ConfigError(
            "--slow: the config gives no limits of speed, acceleration or jerk to keep a share of. "
            "Set constraints.joint_limits.velocity, .acceleration or .jerk."
        )
    with np.errstate(divide="ignore"):
        allowed = share * limits.largest / largest(trajectory, coefficients)
    return float(min(1.0, (allowed ** (1 / np.arange(1, 4))[:, None]).min()))


def slowed_chain(limits: PaceLimits, chain: Chain, share: float) -> tuple[Chain, float]:
    """All segments at the pace of the one that must go slowest, so that they still join; the pace.

    Raises
    ------
    ConfigError
        As `slowing`.
    """
    different = {id(segment): segment for segment in chain.segments}.values()
    pace = min(slowing(limits, each.trajectory, each.coefficients, share) for each in different)
    segments = (replace(s, trajectory=s.trajectory.slowed(pace)) for s in chain.segments)
    return Chain(tuple(segments)), pace


def largest(trajectory: Trajectory, coefficients: Array) -> Array:
    """Bounds (3, n) on the speed, acceleration and jerk of every joint, at every instant."""
    intervals = intervals_of(trajectory, trajectory.duration / _INTERVALS)
    found = np.zeros((3, coefficients.shape[1]))
    for begin in range(0, len(intervals), _CHUNK):
        some: Intervals = intervals.only(slice(begin, begin + _CHUNK))
        states = enclosed_states(trajectory, coefficients, some)
        for order in (1, 2, 3):
            enclosed = states.order(order)
            size = np.maximum(np.abs(enclosed.upper()), np.abs(enclosed.lower()))
            np.maximum(found[order - 1], size.max(axis=0), out=found[order - 1])
    return found
