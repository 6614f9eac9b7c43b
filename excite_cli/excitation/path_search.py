"""A path between two postures around everything that a standing robot must keep clear of.

Two trees of postures grow from the ends towards random postures and towards each other
(RRT-Connect, Kuffner and LaValle 2000); an edge goes on as far as it is free. All postures of an
edge are checked in one call, which costs a tenth of checking them one by one. The way found is then
shortened by random short cuts. The same seed gives the same way, unless time runs out.

Only what depends on the posture counts here: constraints are taken at standstill.
"""

import time
from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Mask
from excite_cli.constraints.base import Array
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.problem import Problem

# Largest change of a joint between two postures that are checked [rad, m].
_TURN, _SLIDE = 0.02, 0.005
_FIRST_BATCH, _LONGEST_EDGE = 32, 256  # postures checked in one go
_EXTENSIONS, _SHORTCUTS = 3000, 150
_GOAL_BIAS = 0.1
_SECONDS = 10.0
# Residual (share of the scale) kept on a way, if the ends have it: first ample, then little.
_ROOM = (0.1, 0.01)
_SHARE_OF_ENDS = 0.5


class FreeSpace:
    """Postures at which standing still leaves `room` (a share of each scale) everywhere.

    Columns for which an end of the way has less must keep half of what it has.
    """

    def __init__(self, problem: Problem, ends: Array, room: float) -> None:
        self.problem = problem
        margins = standing_margins(problem, ends)
        self.least = [
            np.minimum(room * constraint.scale, _SHARE_OF_ENDS * margin.min(axis=0))
            for constraint, margin in zip(problem.constraints, margins, strict=True)
        ]
        limits = problem.robot.limits
        lower, upper = ends.min(axis=0) - np.pi, ends.max(axis=0) + np.pi
        self.lower = np.where(np.isfinite(limits.lower), limits.lower, lower)
        self.upper = np.where(np.isfinite(limits.upper), limits.upper, upper)
        self.step = np.where(problem.robot.sliding, _SLIDE, _TURN)

    def free(self, postures: Array) -> Mask:
        """Which of the postures (P, n) have the room."""
        found = np.ones(len(postures), dtype=bool)
        states = States.still(self.problem.kinematics, postures)
        for constraint, least in zip(self.problem.constraints, self.least, strict=True):
            margins = constraint.margins_within(states, least)
            found &= (margins >= least).all(axis=1)
            if not found.any():
                break
        return found

    def between(self, start: Array, end: Array) -> Array:
        """Postures (P, n) from after `start` to `end`, close enough to be checked."""
        count = max(1, int(np.ceil(np.max(np.abs(end - start) / self.step))))
        return start + np.linspace(0.0, 1.0, count + 1)[1:, None] * (end - start)

    def is_clear(self, start: Array, end: Array) -> bool:
        """Whether the straight path is free; a few postures spread over it are looked at first."""
        postures = self.between(start, end)
        coarse = postures[len(postures) // 16 :: 8]
        if len(postures) > 16 and not self.free(coarse).all():
            return False
        return all(
            self.free(postures[begin : begin + _LONGEST_EDGE]).all()
            for begin in range(0, len(postures), _LONGEST_EDGE)
        )

    def furthest(self, start: Array, end: Array) -> tuple[Array, bool]:
        """How far the straight path from `start` to `end` is free, and whether that is all."""
        postures = self.between(start, end)
        begin, size = 0, _FIRST_BATCH
        while begin < len(postures):
            free = self.free(postures[begin : begin + size])
            if not free.all():
                begin += int(np.argmin(free))
                return (postures[begin - 1] if begin else start), False
            begin, size = begin + size, min(2 * size, _LONGEST_EDGE)
        return postures[-1], True


class _Tree:
    """Postures with their parents; distances are in shares of the ranges of joints."""

    def __init__(self, root: Array, unit: Array) -> None:
        self._unit = unit
        self._scaled = np.empty((256, len(root)))
        self.nodes: list[Array] = []
        self.parents: list[int] = []
        self.add(root, -1)

    def add(self, posture: Array, parent: int) -> int:
        count = len(self.nodes)
        if count == len(self._scaled):
            self._scaled = np.vstack([self._scaled, np.empty_like(self._scaled)])
        self._scaled[count] = posture / self._unit
        self.nodes.append(posture)
        self.parents.append(parent)
        return count

    def nearest(self, posture: Array) -> int:
        away = self._scaled[: len(self.nodes)] - posture / self._unit
        return int(np.argmin(np.einsum("kn,kn->k", away, away)))

    def back_from(self, index: int) -> list[Array]:
        """Postures from the node to the root."""
        found = []
        while index >= 0:
            found.append(self.nodes[index])
            index = self.parents[index]
        return found

    def ranges(self) -> tuple[Array, Array]:
        """Lowest and highest value (n,) of every joint."""
        nodes = np.array(self.nodes)
        return nodes.min(axis=0), nodes.max(axis=0)


@dataclass(frozen=True)
class FoundPath:
    """The way (m, n) from start to end, or None and how far the search came, in words."""

    way: Array | None
    seconds: float
    reached: str = ""


def find_way(problem: Problem, start: Array, end: Array, seed: int) -> FoundPath:
    """A way of straight pieces between two admissible postures (n,); a straight one if it is free.

    Searched with ample room first, then with little, for ten seconds at most (or
    `optimizer.max_seconds`, if that is less).
    """
    began = time.perf_counter()
    seconds = min(_SECONDS, problem.spec.optimizer.max_seconds)
    ends = np.array([start, end])
    reached = ""
    for share, room in enumerate(_ROOM, start=1):
        space = FreeSpace(problem, ends, room)
        deadline = began + seconds * share / len(_ROOM)
        rng = np.random.default_rng((seed, 23, share))
        way, reached = _connected(space, start, end, rng, deadline)
        if way is not None:
            way = _shortened(space, way, rng, deadline)
            return FoundPath(way, time.perf_counter() - began)
    return FoundPath(None, time.perf_counter() - began, reached)


def _connected(
    space: FreeSpace, start: Array, end: Array, rng: np.random.Generator, deadline: float
) -> tuple[Array | None, str]:
    if space.is_clear(start, end):
        return np.array([start, end]), ""
    unit = space.upper - space.lower
    trees = [_Tree(start, unit), _Tree(end, unit)]
    for tried in range(1, _EXTENSIONS + 1):
        growing, other = trees[tried % 2], trees[1 - tried % 2]
        target = rng.uniform(space.lower, space.upper)
        if rng.random() < _GOAL_BIAS:
            target = other.nodes[0]
        grown = _grow(space, growing, target)
        if grown is None:
            pass
        elif (met := _reach(space, other, growing.nodes[grown])) is not None:
            one, two = growing.back_from(grown), other.back_from(met)
            way = [*one[::-1], *two[1:]]
            return np.array(way if tried % 2 == 0 else way[::-1]), ""
        if time.perf_counter() > deadline:
            break
    return None, _reached(space, trees[0], trees[1])


def _reached(space: FreeSpace, first: _Tree, second: _Tree) -> str:
    """How far two trees spread that did not meet: the joint between them, or the smaller one."""
    names = space.problem.robot.joint_names
    (low, high), (other_low, other_high) = first.ranges(), second.ranges()
    width = space.upper - space.lower
    above, below = (other_low - high) / width, (low - other_high) / width
    j = int(np.argmax(np.maximum(above, below)))
    if max(above[j], below[j]) > 0:
        one, two = (high[j], other_low[j]) if above[j] > 0 else (low[j], other_high[j])
        return (
            f"{names[j]} came to {one:.3g} from the start and to {two:.3g} from the end, and not "
            "beyond"
        )
    shares = [float(np.mean((b - a) / width)) for a, b in (first.ranges(), second.ranges())]
    return (
        f"the search spread over {100 * shares[0]:.0f} % of the joints' ranges from the start and "
        f"{100 * shares[1]:.0f} % from the end"
    )


def _grow(space: FreeSpace, tree: _Tree, target: Array) -> int | None:
    """The node added on the way to `target`; None where not a step is free."""
    near = tree.nearest(target)
    reached, _ = space.furthest(tree.nodes[near], target)
    if reached is tree.nodes[near]:
        return None
    return tree.add(reached, near)


def _reach(space: FreeSpace, tree: _Tree, target: Array) -> int | None:
    """The node of the tree at `target`, if the tree can be grown straight to it."""
    near = tree.nearest(target)
    reached, whole = space.furthest(tree.nodes[near], target)
    if reached is not tree.nodes[near]:
        near = tree.add(reached, near)
    return near if whole else None


def _shortened(space: FreeSpace, way: Array, rng: np.random.Generator, deadline: float) -> Array:
    """The way with pieces between random points of it replaced by straight ones."""
    for _ in range(_SHORTCUTS):
        if len(way) == 2 or time.perf_counter() > deadline + 1.0:
            break
        along = _lengths(way, space.upper - space.lower)
        first, last = np.sort(rng.uniform(0.0, along[-1], 2))
        i, j = (int(np.searchsorted(along, at, side="right")) for at in (first, last))
        if i == j:
            continue
        one, two = at_length(way, along, np.array([first, last]))
        if space.is_clear(one, two):
            way = np.vstack([way[:i], one, two, way[j:]])
    return _without_needless(space, way)


def _without_needless(space: FreeSpace, way: Array) -> Array:
    """The way without via postures that a straight piece may leave out."""
    kept, at = [way[0]], 0
    while at < len(way) - 1:
        at = next(
            later
            for later in range(len(way) - 1, at, -1)
            if later == at + 1 or space.is_clear(way[at], way[later])
        )
        kept.append(way[at])
    return np.array(kept)


def _lengths(way: Array, unit: Array) -> Array:
    """Length (m,) up to each posture of the way, in shares of the ranges."""
    pieces = np.linalg.norm(np.diff(way, axis=0) / unit, axis=1)
    return np.concatenate([[0.0], np.cumsum(pieces)])


def at_length(way: Array, along: Array, at: Array) -> Array:
    """Postures (T, n) at the lengths `at` (T,) of a way whose postures are at `along` (m,)."""
    return np.column_stack([np.interp(at, along, joint) for joint in way.T])


def lengths(problem: Problem, way: Array) -> Array:
    """Length (m,) up to each posture, in seconds at the joints' largest speeds (1 where free)."""
    speed = problem.robot.limits.velocity
    return _lengths(way, np.where(np.isfinite(speed), speed, 1.0))


def standing_margins(problem: Problem, postures: Array) -> list[Array]:
    """Margins (P, m) of every constraint, standing still at the postures (P, n)."""
    states = States.still(problem.kinematics, postures)
    return [constraint.margins(states) for constraint in problem.constraints]
