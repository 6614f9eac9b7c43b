"""Distance of the true collision geometry of two groups of links: slow, for judging capsules."""

from collections.abc import Iterable, Iterator
from itertools import product

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.geometry.link_shapes import collision_model
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

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
