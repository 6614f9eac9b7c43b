"""The true collision meshes along a motion: a second pair of eyes beside the capsules.

Nothing is shared with the capsules of the constraint: forward kinematics is Pinocchio's, the
geometry is the URDF's, and coal decides. To be fast, each (pair, instant) is asked in turn: do
balls around the links, do their convex hulls (by separating planes, a proof for each), do the
meshes come nearer than the distance that matters? That last question is far cheaper than a
distance, which is requested only where it lowers the least one found so far.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Array, Indices, Mask
from excite_cli.geometry.link_meshes import LinkMesh, Poses, link_meshes
from excite_cli.geometry.mesh_pairs import (
    MeshPair,
    PairMeshes,
    RelativeReach,
    ball_bounds,
    hull_bounds,
    movable_pairs,
)
from excite_cli.geometry.reasons import ContactMeaning
from excite_cli.robot.model import Robot

NEAR = 0.02  # [m] pairs that stay farther apart are summarised
_ALWAYS = 0.99  # share of random postures in contact
_SAMPLES = 200
_BLOCK = 4000
_BESIDE, _MOST_SPARE = 8, 0.004  # instants, [m]
_LENGTHS = (64, 8)  # instants that are cleared at once
_SELDOM = 10  # of the instants, for pairs that touch at the posture
_ROUNDING = 1e-6  # [m] that coal's answer may be off
_SPARE = 0.002  # [m]


@dataclass(frozen=True)
class MeshGap:
    """The least distance [m] of the meshes of two links along a motion.

    index: of the instant where it occurs; touching: instants at which the meshes touch; standing:
    whether contact breaks the motion, else why it does not. What touches at the posture is looked
    at every tenth instant.
    """

    first: str
    second: str
    distance: float
    index: int
    touching: int
    standing: ContactMeaning = ContactMeaning.JUDGED

    @property
    def broken(self) -> bool:
        """Whether meshes touch that must not."""
        return self.touching > 0 and self.standing is ContactMeaning.JUDGED


@dataclass(frozen=True)
class MeshGaps:
    """All pairs that came near, nearest first; the others stayed at least `beyond` [m] apart.

    pairs: number of pairs looked at, `always`: of those always in contact, which are not.
    """

    near: tuple[MeshGap, ...]
    beyond: float
    pairs: int
    always: tuple[tuple[str, str], ...]

    @property
    def broken(self) -> tuple[MeshGap, ...]:
        """Pairs whose meshes touch and must not."""
        return tuple(gap for gap in self.near if gap.broken)


@dataclass(frozen=True)
class MeshProof:
    """Per interval k and judged pair p, each (K, P).

    distance: a lower bound [m] of that of the meshes at any instant of the interval, −∞ for pairs
    that were not requested; proved: where it exceeds the margin; broken: where the meshes are not
    farther apart than the margin at the instant given, so that no shorter interval can help.
    """

    distance: Array
    proved: Mask
    broken: Mask


class MeshCheck:
    """The collision meshes of all links of `robot` that can move against each other.

    Adjacent links and pairs in `ignore` are left out, pairs in contact in 99 % of random postures
    are listed, those in contact at the posture of the config, and those of links in `by_hand`
    (whose meshes the user has put capsules in place of) are measured but not judged.

    links (L,): names of all links with geometry; joints (L,): the joint of `robot.model` that
    carries each; boxes (L, 8, 3): corners [m] of a box around each in the frame of its joint.
    pairs: all that are measured; judged: those of them whose contact breaks a motion; always: those
    always in contact.
    """

    def __init__(
        self,
        robot: Robot,
        ignore: Iterable[tuple[str, str]] = (),
        by_hand: Collection[str] = (),
        seed: int = 0,
    ) -> None:
        self._robot = robot
        self.meshes: tuple[LinkMesh, ...] = link_meshes(robot)
        self.links = tuple(mesh.link for mesh in self.meshes)
        self.joints = np.array([mesh.joint for mesh in self.meshes], dtype=np.intp)
        self.boxes = np.array([mesh.box for mesh in self.meshes]).reshape(-1, 8, 3)
        self._reach = RelativeReach(robot)
        self._coal: dict[tuple[int, int], PairMeshes] = {}
        pairs = self._with_standing(movable_pairs(robot, self.meshes, ignore), by_hand, seed)
        self.always = tuple(
            pair for pair in pairs if pair.standing is ContactMeaning.ALWAYS_TOUCHING
        )
        self.pairs = tuple(
            pair for pair in pairs if pair.standing is not ContactMeaning.ALWAYS_TOUCHING
        )
        self.judged = tuple(pair for pair in self.pairs if pair.judged)

    def names(self, pair: MeshPair) -> tuple[str, str]:
        """Names of the two links."""
        return self.links[pair.first], self.links[pair.second]

    def least(self, q: Array, near: float = NEAR) -> MeshGaps:
        """The least distance of every pair that comes nearer than `near` [m] at q (T, n)."""
        running = [_Running(near) for _ in self.pairs]
        for begin in range(0, len(q), _BLOCK):
            some = q[begin : begin + _BLOCK]
            poses = Poses.of(self._robot, some)
            stretches = [_Stretches(self._reach, some, poses, length) for length in _LENGTHS]
            seldom = (begin + np.arange(len(some))) % _SELDOM == 0
            balls = ball_bounds(poses, self.meshes, self._indices(self.pairs))
            for p in np.flatnonzero(balls.min(axis=1) <= near):
                pair = self.pairs[p]
                open_ = balls[p] <= running[p].limit
                open_ = open_ & seldom if pair.standing is ContactMeaning.AT_POSTURE else open_
                for stretch in stretches:
                    open_ = stretch.left(self._both(pair), open_, running[p].limit)
                self._follow(running[p], pair, some, poses, open_, begin)
        found = []
        for pair, state in zip(self.pairs, running, strict=True):
            if state.index >= 0:
                names = self.names(pair)
                found.append(
                    MeshGap(*names, state.least, state.index, state.touching, pair.standing)
                )
        return MeshGaps(
            near=tuple(sorted(found, key=lambda gap: gap.distance)),
            beyond=near,
            pairs=len(self.pairs),
            always=tuple(self.names(pair) for pair in self.always),
        )

    def distances(self, q: Array, first: str, second: str) -> Array:
        """Exact distances (T,) [m] of the meshes of two links at q (T, n); slow."""
        pair = (self.links.index(first), self.links.index(second))
        poses = Poses.of(self._robot, q)
        meshes = self._meshes(*pair)
        return np.array([meshes.distance(poses, t) for t in range(len(poses))])

    def proved(
        self,
        q: Array,
        reach: Array | None = None,
        change: Array | None = None,
        margin: float = 0.0,
        asked: Mask | None = None,
    ) -> MeshProof:
        """Which judged pairs stay more than `margin` [m] apart throughout which intervals.

        q (K, n): positions at one instant of each interval, say its middle. Proved where the
        distance there exceeds the margin and what the links can approach each other within the
        interval: by `change` (K, n), how far each joint may be from q (`RelativeReach`), by `reach`
        (K, L) [m], how far any point of each link may be from where it is at q, or by the smaller
        of both. Seen from each other neighbours move far less than in the world, so `change` needs
        far fewer intervals. `asked` (K, P) leaves out pairs that need no proof.
        """
        if reach is None and change is None:
            raise ValueError("give reach or change")
        q = np.atleast_2d(q)
        distance = np.full((len(q), len(self.judged)), -np.inf)
        broken = np.zeros(distance.shape, dtype=bool)
        wanted = np.ones(distance.shape, dtype=bool) if asked is None else asked
        for begin in range(0, len(q), _BLOCK):
            some = slice(begin, begin + _BLOCK)
            poses = Poses.of(self._robot, q[some])
            bounds = ball_bounds(poses, self.meshes, self._indices(self.judged))
            far, turned = (None if each is None else each[some] for each in (reach, change))
            moved = self._moved(poses, far, turned, wanted[some]) + _ROUNDING
            open_ = wanted[some].T & (bounds <= moved + margin)
            for p in np.flatnonzero(open_.any(axis=1)):
                at = np.flatnonzero(open_[p])
                found = self._kept(self.judged[p], poses, at, bounds[p], moved[p] + margin)
                broken[begin + at, p] = found <= margin
                bounds[p, at] = found
            distance[some] = np.where(wanted[some], (bounds - moved).T, -np.inf)
        return MeshProof(distance, distance > margin, broken)

    def _moved(
        self, poses: Poses, reach: Array | None, change: Array | None, wanted: Mask
    ) -> Array:
        """How far (P, K) [m] the links of judged pairs can approach each other."""
        moved = np.full((len(self.judged), len(poses)), np.inf)
        turned = None if change is None else self._reach.at(poses, change)
        for p in np.flatnonzero(wanted.any(axis=0)):
            pair = self.judged[p]
            if reach is not None:
                moved[p] = reach[:, pair.first] + reach[:, pair.second]
            if turned is not None:
                both = self._both(pair)
                np.minimum(moved[p], turned.between(*both), out=moved[p])
        return moved

    def _kept(
        self, pair: MeshPair, poses: Poses, at: Indices, bounds: Array, needed: Array
    ) -> Array:
        """Lower bounds of a pair's distance [m] `at` some instants, where balls say too little.

        `bounds` (K,) are those of the balls, `needed` (K,) [m] what proves the pair apart.
        """
        both = self._both(pair)
        bounds = np.maximum(bounds[at], hull_bounds(poses, both, at, needed[at]))
        meshes = self._meshes(pair.first, pair.second)
        for k in np.flatnonzero(bounds <= needed[at]).tolist():
            # A little beyond what is needed: what passes shall pass with a margin.
            bounds[k] = meshes.distance(poses, int(at[k]), below=float(needed[at[k]]) + _SPARE)
        return bounds

    def _follow(
        self, state: "_Running", pair: MeshPair, q: Array, poses: Poses, open_: Mask, begin: int
    ) -> None:
        """Bring the least distance of a pair up to date with those of a block of instants."""
        instants = np.flatnonzero(open_)
        both = self._both(pair)
        bounds = hull_bounds(poses, both, instants, np.full(len(instants), state.limit))
        near = bounds <= state.limit
        instants, bounds = instants[near], np.maximum(bounds[near], 0.0)
        if not len(instants):
            return
        meshes = self._meshes(pair.first, pair.second)
        steps = self._reach.between(
            poses.at(instants[:-1]), *both, np.abs(np.diff(q[instants], axis=0))
        )
        path = np.concatenate([[0.0], np.cumsum(steps)])
        cleared = np.zeros(len(instants), dtype=bool)
        # Near ones first, and those whose hulls cross far from each other in time first, so that
        # the least distance falls soon: it caps the cost of the rest.
        for k in np.lexsort((_spread(len(instants)), bounds)).tolist():
            if bounds[k] > state.limit:
                break
            if cleared[k]:
                continue
            cap = max(state.limit - _ROUNDING, _ROUNDING)
            if state.least <= 0.0 and not pair.judged:  # how deep is of no interest
                state.touching += meshes.touch(poses, int(instants[k]))
                continue
            # A distance a little beyond the cap costs more, and clears the instants beside it.
            beside = path[min(k + _BESIDE, len(path) - 1)] - path[max(k - _BESIDE, 0)]
            spare = min(beside / 2, _MOST_SPARE)
            distance = meshes.distance(poses, int(instants[k]), cap + spare)
            if distance < cap:
                state.add(distance, begin + int(instants[k]))
            # The distance changes by no more than the links move towards each other.
            room = distance - cap
            if room > 0.0:
                low, high = np.searchsorted(path, [path[k] - room, path[k] + room])
                cleared[low:high] = True

    def _meshes(self, first: int, second: int) -> PairMeshes:
        if (first, second) not in self._coal:
            self._coal[first, second] = PairMeshes(self.meshes[first], self.meshes[second])
        return self._coal[first, second]

    def _both(self, pair: MeshPair) -> tuple[LinkMesh, LinkMesh]:
        return self.meshes[pair.first], self.meshes[pair.second]

    @staticmethod
    def _indices(pairs: tuple[MeshPair, ...]) -> Indices:
        return np.array([(p.first, p.second) for p in pairs], dtype=np.intp).reshape(-1, 2)

    def _with_standing(
        self, pairs: list[tuple[int, int]], by_hand: Collection[str], seed: int
    ) -> list[MeshPair]:
        q = np.vstack([self._robot.posture, self._robot.draw_states(_SAMPLES, seed)[0]])
        poses = Poses.of(self._robot, q)
        balls = ball_bounds(poses, self.meshes, np.array(pairs, dtype=np.intp).reshape(-1, 2))
        found = []
        for pair, bounds in zip(pairs, balls, strict=True):
            touching = self._touching(pair, poses, bounds)
            standing = ContactMeaning.JUDGED
            if touching.mean() >= _ALWAYS:
                standing = ContactMeaning.ALWAYS_TOUCHING
            elif {self.links[pair[0]], self.links[pair[1]]} & set(by_hand):
                standing = ContactMeaning.BY_HAND
            elif touching[0]:
                standing = ContactMeaning.AT_POSTURE
            found.append(MeshPair(*pair, standing))
        return found

    def _touching(self, pair: tuple[int, int], poses: Poses, balls: Array) -> Mask:
        """At which instants (T,) the meshes touch; only the first decides where few do."""
        touching = np.zeros(len(poses), dtype=bool)
        instants = np.flatnonzero(balls <= 0.0)
        if not len(instants):
            return touching
        both = (self.meshes[pair[0]], self.meshes[pair[1]])
        hulls = hull_bounds(poses, both, instants, np.zeros(len(instants)))
        meshes = self._meshes(*pair)
        for t in instants[hulls <= 0.0].tolist():
            touching[t] = meshes.touch(poses, t)
        return touching


class _Stretches:
    """The instants of q (T, n) in stretches of `length`, each judged by the one in its middle."""

    def __init__(self, reach: RelativeReach, q: Array, poses: Poses, length: int) -> None:
        first = np.arange(0, len(q), length)
        self._stretch = np.arange(len(q)) // length
        self._middles = np.minimum(first + length // 2, len(q) - 1)
        change = np.abs(q - q[self._middles[self._stretch]])
        self._poses = poses.at(self._middles)
        self._reach = reach.at(self._poses, np.maximum.reduceat(change, first, axis=0))

    def left(self, both: tuple[LinkMesh, LinkMesh], open_: Mask, limit: float) -> Mask:
        """Those of the open instants in stretches where the links may come within `limit` [m]."""
        asked = np.unique(self._stretch[open_])
        moved = self._reach.between(*both)[asked]
        apart = hull_bounds(self._poses, both, asked, limit + moved) - moved > limit
        cleared = np.zeros(len(self._middles), dtype=bool)
        cleared[asked[apart]] = True
        return np.asarray(open_ & ~cleared[self._stretch])


class _Running:
    """The least distance of one pair so far; starts at the distance that is called near."""

    def __init__(self, near: float) -> None:
        self.least, self.index, self.touching = near, -1, 0

    @property
    def limit(self) -> float:
        """Distances beyond this tell nothing new [m]."""
        return max(self.least, 0.0)

    def add(self, distance: float, index: int) -> None:
        self.touching += distance <= 0.0
        if distance < self.least:
            self.least, self.index = distance, index


def _spread(count: int) -> Indices:
    """A rank for each of `count` instants: every 256th first, then those halfway between."""
    instants = np.arange(count)
    lowest = np.where(instants > 0, instants & -instants, count)
    return np.argsort(np.argsort(-np.minimum(lowest, 256), kind="stable"), kind="stable")
