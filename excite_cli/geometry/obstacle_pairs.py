"""Which capsules are checked against which obstacles, and why the others are not.

What stands still is not checked: no motion parts it from an obstacle or brings it there. The other
pairs are checked, unless a bound on the robot's reach proves that they never meet, or no motion
parts them: the first moved link of a robot that stands on a table touches the table. Such a pair is
known by its distance in a sample of postures: below the margin and the same in all of them, or
never above zero for a link that one joint moves. Other pairs that always overlap stay: they tell of
a table in the wrong place. Where a link never gets far from an obstacle (the upper arm passes the
table close by whatever it does), half of the farthest is kept instead of the margin.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from excite_cli.config.constraints_spec import SurroundingsSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.geometry.capsules import link_names
from excite_cli.geometry.obstacle_distances import ObstacleDistances
from excite_cli.geometry.obstacles import FLOOR, Obstacle
from excite_cli.geometry.reasons import DroppedPair, Reason, Why, reason_in_words
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import MovedBodies
from excite_cli.robot.model import Array, Robot

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
