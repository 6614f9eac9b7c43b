"""Capsules and obstacles: which are checked against which, and how far apart they are.

What stands still is not checked: no motion parts it from an obstacle or brings it there. The other
pairs are checked, unless a bound on the robot's reach proves that they never meet, or no motion
parts them: the first moved link of a robot that stands on a table touches the table. Such a pair is
known by its distance in a sample of postures: below the margin and the same in all of them, or
never above zero for a link that one joint moves. Other pairs that always overlap stay: they tell of
a table in the wrong place. Where a link never gets far from an obstacle (the upper arm passes the
table close by whatever it does), half of the farthest is kept instead of the margin.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Indices
from excite_cli.config.constraints_spec import SurroundingsSpec
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.errors import ConfigError, nearest
from excite_cli.geometry.capsules import link_names
from excite_cli.geometry.obstacles import FLOOR, Box, Obstacle
from excite_cli.geometry.reasons import DroppedPair, Reason, Why, reason_in_words
from excite_cli.geometry.world_segments import CapsuleAxes, WorldSegments
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import MovedBodies, carried_bodies
from excite_cli.robot.model import Array, Robot

# Distances of capsules from obstacles that stand still, along a motion, and their derivatives.
#
# The distance is that of the capsule's axis less its radius. With n the unit normal of the
# obstacle and p the witness point on the axis, dd/dq_k = n·(v_k + ω_k × p) for every joint k that
# carries the capsule, (v_k, ω_k) its twist about the world origin.

_BLOCK = 4000


class ObstacleDistances:
    """Signed distances of pairs (capsule, obstacle), by their indices, for arrays of positions."""

    def __init__(
        self,
        robot: Robot,
        capsules: Sequence[Capsule],
        obstacles: Sequence[Obstacle],
        pairs: Sequence[tuple[int, int]],
    ) -> None:
        self._robot = robot
        checked = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        used, self._capsule = np.unique(checked[:, 0], return_inverse=True)
        self._thing = checked[:, 1]
        kept = [capsules[index] for index in used]
        self._axes = CapsuleAxes(robot, kept)
        radius = np.array([capsule.radius for capsule in kept])
        self._radii = radius[self._capsule]
        ball = radius + 0.5 * np.linalg.norm(self._axes.along, axis=1)
        self._balls = ball[self._capsule]
        self._carried = carried_bodies(robot)[self._axes.joints][self._capsule]  # (P, m)
        self._groups = [
            (obstacle, np.flatnonzero(self._thing == index))
            for index, obstacle in enumerate(obstacles)
        ]

    @property
    def n_pairs(self) -> int:
        """Number of pairs P."""
        return len(self._capsule)

    def distances(self, q: Array | States, exact_below: float = np.inf) -> Array:
        """Signed distances (T, P) [m] at moved-joint positions q (T, n), or at states.

        Where a ball around the capsule already shows the distance from a box to be at least
        `exact_below`, that bound is returned instead.
        """
        world = self._axes.in_world(q)
        result = np.empty((self.n_pairs, world.start.shape[2]))
        for obstacle, columns in self._groups:
            if isinstance(obstacle, Box) and np.isfinite(exact_below):
                result[columns] = self._where_near(world, obstacle, columns, exact_below)
                continue
            size = max(1, _BLOCK // max(result.shape[1], 1))
            for k in range(0, len(columns), size):  # blocks that stay in the processor's cache
                some = columns[k : k + size]
                at = self._capsule[some]
                axis = obstacle.distances(world.start[:, at], world.along[:, at])
                result[some] = axis - self._radii[some, None]
        return result.T

    def _where_near(
        self, world: WorldSegments, obstacle: Obstacle, columns: Indices, exact_below: float
    ) -> Array:
        """Distances (K, T) where they may be below the bound, else bounds from balls."""
        capsule = self._capsule[columns]
        start, along = world.start[:, capsule], world.along[:, capsule]
        found = obstacle.point_distances(start + 0.5 * along) - self._balls[columns, None]
        near = np.nonzero(found < exact_below)
        for k in range(0, len(near[0]), _BLOCK):
            one, at = near[0][k : k + _BLOCK], near[1][k : k + _BLOCK]
            axis = obstacle.distances(start[:, one, at], along[:, one, at])
            found[one, at] = axis - self._radii[columns[one]]
        return found

    def gradients(self, q: Array | States, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        world = self._axes.in_world(q)
        normal, point = np.empty((3, len(rows))), np.empty((3, len(rows)))
        things = self._thing[cols]
        for index, (obstacle, _) in enumerate(self._groups):
            some = np.flatnonzero(things == index)
            if not len(some):
                continue
            place = (slice(None), self._capsule[cols[some]], rows[some])
            start, along = world.start[place], world.along[place]
            contact = obstacle.contacts(start, along)
            normal[:, some], point[:, some] = contact.normal, start + contact.share * along
        wrench = np.hstack([normal.T, np.cross(point.T, normal.T)])
        twists = world.columns()[rows][:, self._robot.tree.moved]  # (K, m, 6)
        return self._robot.gathered(self._carried[cols] * (twists @ wrench[..., None])[..., 0])


_SAMPLES, _SEED = 300, 0
_SHARE_OF_FARTHEST = 0.5
_UNCHANGED = 0.005  # [m] by which the distance of a pair that no motion parts may change


@dataclass(frozen=True)
class ObstaclePairs:
    """Pairs (capsule, obstacle) to check, by index, and those left out.

    `kept` (P,) [m]: the distance that each checked pair keeps, the margin or less.
    """

    checked: tuple[tuple[int, int], ...]
    kept: Array
    dropped: tuple[DroppedPair, ...]


def ignored_pairs(robot: Robot, spec: SurroundingsSpec) -> frozenset[tuple[str, str]]:
    """Pairs (link, obstacle) of `spec.ignore`, in whichever order they were written.

    Raises
    ------
    ConfigError
        A name is neither a link of the robot nor an obstacle.
    """
    links = link_names(robot)
    things = [*([FLOOR] if spec.floor is not None else []), *spec.walls, *spec.boxes]
    found = set()
    for first, second in spec.ignore:
        if first not in links and (second in links or first in things):
            first, second = second, first
        if first not in links:
            _unknown("link", first, links)
        if second not in things:
            _unknown("obstacle", second, things)
        found.add((first, second))
    return frozenset(found)


def _unknown(kind: str, name: str, known: list[str]) -> None:
    whose = "the robot has no link" if kind == "link" else "there is no obstacle"
    raise ConfigError(
        f"constraints.surroundings.ignore: {whose} '{name}'.{nearest(name, known)} Write pairs of "
        f"a link and an obstacle. {kind.capitalize()}s: {', '.join(sorted(known))}."
    )


def choose_obstacle_pairs(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    obstacles: tuple[Obstacle, ...],
    spec: SurroundingsSpec,
    bounded: bool = True,
) -> ObstaclePairs:
    """The pairs of `robot`, in order of the capsules.

    Only where positions are `bounded` by a constraint is anything out of reach.

    Raises
    ------
    ConfigError
        `spec.ignore` names what is not there, or all that can be reached always touches.
    """
    ignored = ignored_pairs(robot, spec)
    moved = MovedBodies(robot)
    moved_by = [len(moved.moving(joint)) for joint in range(robot.model.njoints)]
    reach = _Reach(robot)
    possible: list[tuple[int, int]] = []
    dropped: dict[tuple[int, int], Reason] = {}
    for i, capsule in enumerate(capsules):
        if not moved_by[capsule.joint]:
            continue
        for j, obstacle in enumerate(obstacles):
            least = reach.least_distance(capsule, obstacle)
            if any((link, obstacle.name) in ignored for link in capsule.links):
                dropped[i, j] = Reason(Why.IGNORED)
            elif bounded and least > spec.margin:
                dropped[i, j] = Reason(Why.OUT_OF_REACH)
            else:
                possible.append((i, j))
    distances = ObstacleDistances(robot, capsules, obstacles, possible).distances(
        robot.draw_states(_SAMPLES, _SEED)[0]
    )
    for k, (i, j) in enumerate(possible):
        # A payload is no part that was built to touch something.
        if robot.payload is None or capsules[i].name != robot.payload.capsule.name:
            reason = _inseparable(distances[:, k], spec.margin, moved_by[capsules[i].joint])
            if reason:
                dropped[i, j] = reason
    left = [k for k, pair in enumerate(possible) if pair not in dropped]
    farthest = np.maximum(distances.max(axis=0, initial=0.0), 0.0)[left]
    chosen = ObstaclePairs(
        checked=tuple(possible[k] for k in left),
        kept=np.minimum(spec.margin, _SHARE_OF_FARTHEST * farthest),
        dropped=tuple(
            DroppedPair(capsules[i].name, obstacles[j].name, dropped[i, j])
            for i, j in sorted(dropped)
        ),
    )
    if possible and not chosen.checked:
        i, j = possible[0]
        raise ConfigError(
            f"constraints.surroundings: nothing is left to check: {capsules[i].name} and "
            f"{obstacles[j].name} are {reason_in_words(dropped[i, j])} in every posture. "
            f"Correct the place of {obstacles[j].name}, or list the pair under "
            "constraints.surroundings.ignore."
        )
    return chosen


def _inseparable(distances: Array, margin: float, moved_by: int) -> Reason | None:
    """Why a pair whose distances over the sample are these cannot be parted; None if it can."""
    low, high = float(distances.min()), float(distances.max())
    unchanged = high < margin and high - low <= _UNCHANGED
    if not unchanged and not (high <= 0 and moved_by == 1):
        return None
    if low < 0:
        return Reason(Why.ALWAYS_TOUCHING, -low)
    return Reason(Why.ALWAYS_NEAR, low)


class _Reach:
    """How far from a fixed point everything on a joint stays, whatever the posture."""

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        data = model.createData()
        pin.forwardKinematics(model, data, robot.reference)
        self._centers = np.zeros((model.njoints, 3))
        self._radii = np.zeros(model.njoints)
        first, tree = robot.first_joint, robot.tree
        limits = tree.limits
        travel = np.where(tree.sliding, np.maximum(np.abs(limits.lower), np.abs(limits.upper)), 0.0)
        for joint in range(first, model.njoints):
            parent, placement = int(model.parents[joint]), model.jointPlacements[joint]
            if parent < first:
                self._centers[joint] = (data.oMi[parent] * placement).translation
            else:
                self._centers[joint] = self._centers[parent]
                self._radii[joint] = self._radii[parent]
                self._radii[joint] += np.linalg.norm(placement.translation)
            self._radii[joint] += travel[joint - first]

    def least_distance(self, capsule: Capsule, obstacle: Obstacle) -> float:
        """A distance [m] below which the capsule never comes."""
        ends = np.linalg.norm([capsule.start, capsule.end], axis=1).max()
        center = float(obstacle.point_distances(self._centers[capsule.joint]))
        return center - float(self._radii[capsule.joint] + ends + capsule.radius)
