"""Distances of capsules from each other or from obstacles, by coal through Pinocchio.

One instant at a time, with Pinocchio's kinematics and coal's algorithms: an independent
computation of what `PairDistances` and `ObstacleDistances` give for all instants at once. coal's
own shortest way out replaces the distance of the axes only where they cross.

coal works in millimetres here: it takes axes as parallel, and as points, by an absolute measure of
1e-12, which in metres would cost up to some 1e-6 m where axes are all but parallel.
"""

from collections.abc import Sequence

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.geometry.obstacles import Obstacle
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]

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
