"""Admissible pieces of movement: from one state to another, and between two postures at rest.

A piece is a polynomial of degree five (`PointToPoint`) of the shortest duration, of a geometric
sequence, that a judge accepts. Between postures it is straight; where something is in between, it
is one piece after the other along a path around what is in between, at rest at every corner.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation.admissible import CONTROLLER_RATE, path_of
from excite_cli.excitation.base_motion import disconnected, straight_block
from excite_cli.excitation.path_search import find_way
from excite_cli.excitation.problem import Problem
from excite_cli.proof.certificate import certify
from excite_cli.trajectory.base import Trajectory
from excite_cli.trajectory.fade import Segment
from excite_cli.trajectory.point_to_point import PointToPoint

Judge = Callable[[Trajectory, Array], str | None]
"""None if a trajectory with these coefficients (K, n) is admissible, else what it breaks."""

_GROWTH, _DURATIONS = 1.15, 40
_SHORTEST = 0.1  # [s]
_SAME = 1e-9  # [rad, m]
_ROUGH = 60  # instants that are looked at before a judge is asked
# Largest derivatives of the polynomial from rest to rest over a unit of way and time, by their
# order: 10 s³ − 15 s⁴ + 6 s⁵ has 15/8 at s = 1/2, 10/√3 at s = 1/2 ± 1/√12, 60 at the ends.
_LARGEST = {Quantity.VELOCITY: 15 / 8, Quantity.ACCELERATION: 10 / np.sqrt(3), Quantity.JERK: 60.0}


@dataclass(frozen=True)
class State:
    """q, v, a (n,) at one instant."""

    q: Array
    v: Array
    a: Array

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves."""
        return bool(max(np.abs(self.v).max(), np.abs(self.a).max()) < 1e-9)

    @classmethod
    def resting(cls, posture: Array) -> "State":
        """At rest at `posture` (n,)."""
        return cls(posture, np.zeros_like(posture), np.zeros_like(posture))

    @classmethod
    def of(cls, trajectory: Trajectory, coefficients: Array, time: float) -> "State":
        """That of a trajectory at `time` [s]."""
        q, v, a = trajectory.states(np.array([time]), coefficients)
        return cls(q[0], v[0], a[0])


def judge_of(problem: Problem) -> Judge:
    """What judges motions of `problem`: certificates where it asks for them, else 1 kHz."""

    def judge(trajectory: Trajectory, coefficients: Array) -> str | None:
        count = max(2, int(np.ceil(trajectory.duration * CONTROLLER_RATE)) + 1)
        if not problem.spec.optimizer.certify:
            return broken(problem, trajectory, coefficients, count)
        found = certify(path_of(problem, trajectory, coefficients), problem.constraints)
        for verdict in found:
            if verdict.bounded and not verdict.proved:
                return f"{verdict.name} ({verdict.label})"
        if all(verdict.bounded for verdict in found):
            return None
        return broken(problem, trajectory, coefficients, count)

    return judge


def broken(
    problem: Problem, trajectory: Trajectory, coefficients: Array, instants: int
) -> str | None:
    """The constraint that is broken most, in words, at so many instants; None if all are kept."""
    times = np.linspace(0.0, trajectory.duration, instants)
    states = States.along(problem.kinematics, trajectory, coefficients, times)
    lowest, words = 0.0, None
    for constraint in problem.constraints:
        margins = constraint.margins_within(states, np.zeros_like(constraint.scale))
        share = margins.min(axis=0) / constraint.scale
        column = int(np.argmin(share))
        if share[column] < lowest:
            lowest, words = share[column], f"{constraint.name} ({constraint.labels[column]})"
    return words


def joined_states(problem: Problem, judge: Judge, name: str, start: State, end: State) -> Segment:
    """The quickest accepted polynomial from state to state.

    Raises
    ------
    NoAdmissibleMotionError
        None is accepted; the message names what the last of them breaks.
    """
    coefficients = np.array([start.q, start.v, start.a, end.q, end.v, end.a])
    words = None
    for duration in _durations(problem, start, end):
        trajectory = PointToPoint(duration)
        words = broken(problem, trajectory, coefficients, _ROUGH)
        words = words or judge(trajectory, coefficients)
        if words is None:
            return Segment(name, trajectory, coefficients)
    raise NoAdmissibleMotionError(f"even the slowest movement breaks {words}")


def resting_way(
    problem: Problem, judge: Judge, name: str, ends: tuple[Array, Array], seed: int
) -> list[Segment]:
    """Pieces from rest at the first posture (n,) to rest at the second, none if they are the same.

    Raises
    ------
    NoAdmissibleMotionError
        No admissible way was found; the message says what blocks the straight one.
    """
    start, end = ends
    if np.abs(end - start).max() < _SAME:
        return []
    block = straight_block(problem, start, end)
    if block is None:
        try:
            return [joined_states(problem, judge, name, State.resting(start), State.resting(end))]
        except NoAdmissibleMotionError as error:
            block = str(error)
    search = find_way(problem, start, end, seed)
    if search.way is None:
        raise NoAdmissibleMotionError(disconnected(block, search.reached))
    corners = [State.resting(posture) for posture in search.way]
    try:
        return [joined_states(problem, judge, name, one, two) for one, two in pairwise(corners)]
    except NoAdmissibleMotionError as error:
        raise NoAdmissibleMotionError(
            f"the straight path is blocked ({block}); a path around exists, but on a piece of it "
            f"{error}"
        ) from error


def _durations(problem: Problem, start: State, end: State) -> Iterator[float]:
    """From the shortest that limits of derivatives may allow, each longer by a fixed share."""
    away, shortest = np.abs(end.q - start.q), _SHORTEST
    if start.at_rest and end.at_rest:
        for constraint in problem.constraints:
            columns = constraint.linear
            if columns is not None and columns.quantity in _LARGEST:
                way = away[columns.joints] / columns.bounds
                needed = (way * _LARGEST[columns.quantity]) ** (1 / columns.quantity)
                shortest = max(shortest, float(needed.max(initial=0.0)) * (1 + 1e-9))
    for power in range(_DURATIONS):
        yield shortest * _GROWTH**power
