"""Distances between capsules by coal through Pinocchio, one instant at a time.

The reference that `Clearance` is checked against: an independent computation of the same
distances. coal's own shortest way out replaces the distance of the segments only where they cross.
"""

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class CoalClearance:
    """The interface of `Clearance`, computed by coal."""

    def __init__(self, robot: Robot, capsules: tuple[Capsule, ...], pairs: CollisionPairs) -> None:
        self._robot = robot
        self._data = robot.model.createData()
        self._geometry = pin.GeometryModel()
        for number, capsule in enumerate(capsules):
            self._geometry.addGeometryObject(_geometry_object(number, capsule))
        for first, second in pairs.checked:
            self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._joints = [(capsules[i].joint, capsules[j].joint) for i, j in pairs.checked]
        self._state = pin.GeometryData(self._geometry)

    @property
    def n_pairs(self) -> int:
        """Number of checked pairs P."""
        return len(self._joints)

    def distances(self, q: Array) -> Array:
        """Signed distances (T, P) [m] at moved-joint positions q (T, n)."""
        configurations = self._robot.configurations(np.asarray(q, dtype=float))
        result = np.empty((len(configurations), self.n_pairs))
        for t, configuration in enumerate(configurations):
            self._compute(configuration)
            result[t] = [one.min_distance for one in self._state.distanceResults]
        return result

    def gradients(self, q: Array, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        configurations = self._robot.configurations(np.asarray(q, dtype=float))
        result = np.empty((len(rows), self._robot.n))
        for t in np.unique(rows):
            self._compute(configurations[t])
            pin.computeJointJacobians(self._robot.model, self._data, configurations[t])
            for k in np.flatnonzero(rows == t):
                result[k] = self._gradient(int(cols[k]))
        return result

    def _compute(self, configuration: Array) -> None:
        pin.computeDistances(
            self._robot.model, self._data, self._geometry, self._state, configuration
        )

    def _gradient(self, pair: int) -> Array:
        answer = self._state.distanceResults[pair]
        normal = np.asarray(answer.normal).ravel()
        slopes = []
        for joint, point in zip(
            self._joints[pair], (answer.getNearestPoint1(), answer.getNearestPoint2()), strict=True
        ):
            wrench = np.concatenate([normal, np.cross(np.asarray(point).ravel(), normal)])
            columns = pin.getJointJacobian(
                self._robot.model, self._data, joint, pin.ReferenceFrame.WORLD
            )
            slopes.append(wrench @ columns if joint else np.zeros(self._robot.model.nv))
        return (slopes[1] - slopes[0])[self._robot.moved]


def _geometry_object(number: int, capsule: Capsule) -> pin.GeometryObject:
    along = capsule.end - capsule.start
    length = float(np.linalg.norm(along))
    turn = np.eye(3)
    if length > 0:
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length).matrix()
    return pin.GeometryObject(
        f"{number}:{capsule.name}",
        capsule.joint,
        pin.SE3(turn, (capsule.start + capsule.end) / 2),
        coal.Capsule(capsule.radius, length),
    )
