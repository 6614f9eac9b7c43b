"""Distances by coal: of the true collision geometry of groups of links, and of capsules."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import product

import coal
import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array as Array
from excite_cli.arrays import Indices
from excite_cli.geometry.link_shapes import collision_model
from excite_cli.geometry.obstacles import Obstacle
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

Placed = tuple[pin.CollisionGeometry, coal.Transform3s]

_LEAST_CAP = 1e-9  # [m]; what is capped at nothing is not looked at
_FIRST_STEP, _LAST_STEP = 0.2, 0.01  # [rad or m]


class MeshDistances:
    """Distances between the meshes and primitives of links, by coal."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._geometry = collision_model(robot)
        self._data = robot.model.createData()
        self._items: dict[str, list[tuple[int, pin.SE3, pin.CollisionGeometry]]] = {}
        for item in self._geometry.geometryObjects:
            link = str(robot.model.frames[item.parentFrame].name)
            entry = (int(item.parentJoint), item.placement.copy(), item.geometry)
            self._items.setdefault(link, []).append(entry)
        self._lower, self._upper = robot.limits.ranges()

    def knows(self, links: Iterable[str]) -> bool:
        """Whether all these links have collision geometry."""
        return all(link in self._items for link in links)

    def distance(
        self, first: Iterable[str], second: Iterable[str], q: Array, below: float = np.inf
    ) -> float:
        """Least distance [m] between two groups of links at moved-joint positions q (n,).

        Or `below` where it is not less, which is sooner known.
        """
        least = below
        request, answer = coal.DistanceRequest(), coal.DistanceResult()
        for (shape, one), (other_shape, two) in self._placed(first, second, q):
            answer.clear()
            answer.min_distance = max(min(least, answer.min_distance), _LEAST_CAP)
            coal.distance(shape, one, other_shape, two, request, answer)
            least = min(least, answer.min_distance)
        return float(least)

    def touch(self, first: Iterable[str], second: Iterable[str], q: Array) -> bool:
        """Whether two groups of links touch at moved-joint positions q (n,)."""
        request, answer = coal.CollisionRequest(), coal.CollisionResult()
        for (shape, one), (other_shape, two) in self._placed(first, second, q):
            answer.clear()
            if coal.collide(shape, one, other_shape, two, request, answer):
                return True
        return False

    def least_distance(
        self,
        first: Iterable[str],
        second: Iterable[str],
        starts: Array,
        moved: Indices,
        stop: float,
    ) -> float:
        """Least distance [m] found at `starts` (S, n) and by a search from the best three.

        Only joints numbered in `moved` are varied. Ends early at a distance below `stop`.
        """
        first, second = tuple(first), tuple(second)
        found: list[float] = []
        for q in starts:
            third = sorted(found)[2] if len(found) > 2 else np.inf
            found.append(self.distance(first, second, q, below=third))
            if found[-1] < stop:
                return found[-1]
        least = np.inf
        for index in np.argsort(found, kind="stable")[:3]:
            value = self._search((first, second), starts[index], moved, found[index], stop)
            least = min(least, value)
            if least < stop:
                break
        return least

    def _search(
        self,
        links: tuple[tuple[str, ...], tuple[str, ...]],
        q: Array,
        moved: Indices,
        value: float,
        stop: float,
    ) -> float:
        step = _FIRST_STEP
        while step > _LAST_STEP and value >= stop:
            better = False
            for joint in moved:
                for change in (step, -step):
                    trial = q.copy()
                    trial[joint] = np.clip(
                        q[joint] + change, self._lower[joint], self._upper[joint]
                    )
                    distance = self.distance(*links, trial, below=value)
                    if distance < value - 1e-6:
                        q, value, better = trial, distance, True
                        break
            if not better:
                step /= 2
        return value

    def _placed(
        self, first: Iterable[str], second: Iterable[str], q: Array
    ) -> Iterator[tuple[Placed, Placed]]:
        """All pairs of shapes of two groups of links, with where they stand."""
        model = self._robot.model
        pin.forwardKinematics(model, self._data, self._robot.configurations(q[None])[0])
        return product(self._of(first), self._of(second))

    def _of(self, links: Iterable[str]) -> Iterator[Placed]:
        for link in links:
            for joint, place, shape in self._items[link]:
                world = self._data.oMi[joint] * place if joint else place
                yield shape, coal.Transform3s(world.rotation, world.translation)


# Distances of capsules from each other or from obstacles, by coal through Pinocchio.
#
# One instant at a time, with Pinocchio's kinematics and coal's algorithms: an independent
# computation of what `PairDistances` and `ObstacleDistances` give for all instants at once.
# coal's own shortest way out replaces the distance of the axes only where they cross.
#
# coal works in millimetres here: it takes axes as parallel, and as points, by an absolute measure
# of 1e-12, which in metres would cost up to some 1e-6 m where axes are all but parallel.

_SCALE = 1000.0  # [mm/m]
_TOLERANCE = 1e-10  # of coal's iterations, by which it measures boxes


class CoalDistances:
    """Signed distances of pairs of capsules, or of pairs (capsule, obstacle), by their indices."""

    def __init__(
        self,
        robot: Robot,
        capsules: Sequence[Capsule],
        pairs: Sequence[tuple[int, int]],
        obstacles: Sequence[Obstacle] = (),
    ) -> None:
        """With `obstacles`, the second index of a pair is that of an obstacle."""
        self.robot = robot
        self.data = robot.model.createData()
        geometry = pin.GeometryModel()
        bodies = [_of_capsule(number, capsule) for number, capsule in enumerate(capsules)]
        bodies += [_of_obstacle(obstacle) for obstacle in obstacles]
        for body in bodies:
            geometry.addGeometryObject(body)
        shift = len(capsules) if obstacles else 0
        for first, second in pairs:
            geometry.addCollisionPair(pin.CollisionPair(first, second + shift))
        self._geometry, self._state = geometry, pin.GeometryData(geometry)
        for request in self._state.distanceRequests:
            request.gjk_tolerance = request.epa_tolerance = _TOLERANCE
        # Views into Pinocchio's data: asking anew for each instant would take most of the time.
        self._places = [place.translation for place in self._state.oMg]
        self.results = list(self._state.distanceResults)
        self.joints = [
            (bodies[first].parentJoint, bodies[second + shift].parentJoint)
            for first, second in pairs
        ]

    def distances(self, q: Array) -> Array:
        """Signed distances (T, P) [m] at moved-joint positions q (T, n)."""
        configurations = self.robot.configurations(np.asarray(q, dtype=float))
        result = np.empty((len(configurations), len(self.joints)))
        for t, configuration in enumerate(configurations):
            self.measure(configuration)
            result[t] = [one.min_distance for one in self.results]
        return result / _SCALE

    def measure(self, configuration: Array) -> None:
        """All distances at one configuration of `robot.model`, into `results`, in millimetres."""
        model, state = self.robot.model, self._state
        pin.updateGeometryPlacements(model, self.data, self._geometry, state, configuration)
        for place in self._places:
            place *= _SCALE
        pin.computeDistances(self._geometry, state)


def _of_capsule(number: int, capsule: Capsule) -> pin.GeometryObject:
    along = capsule.end - capsule.start
    length = float(np.linalg.norm(along))
    turn = np.eye(3)
    if length > 0:
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).matrix()
    place = pin.SE3(turn, (capsule.start + capsule.end) / 2)
    shape = coal.Capsule(_SCALE * capsule.radius, _SCALE * length)
    return pin.GeometryObject(f"{number}:{capsule.name}", capsule.joint, place, shape)


def _of_obstacle(obstacle: Obstacle) -> pin.GeometryObject:
    shape, rotation, position = obstacle.as_coal(_SCALE)
    return pin.GeometryObject(f"obstacle:{obstacle.name}", 0, pin.SE3(rotation, position), shape)
