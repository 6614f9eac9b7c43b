"""Derivatives of coal's distances, pair by pair: what `Clearance.gradients` is held against."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.geometry.coal_distances import Array, CoalDistances

Indices = NDArray[np.intp]


class CoalGradients(CoalDistances):
    """`CoalDistances` with derivatives from its witness points, which are in millimetres."""

    def gradients(self, q: Array, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        configurations = self.robot.configurations(np.asarray(q, dtype=float))
        result = np.empty((len(rows), self.robot.n))
        for t in np.unique(rows):
            self.measure(configurations[t])
            pin.computeJointJacobians(self.robot.model, self.data, configurations[t])
            for k in np.flatnonzero(rows == t):
                result[k] = self._gradient(int(cols[k]))
        return result

    def _gradient(self, pair: int) -> Array:
        answer = self.results[pair]
        normal = np.asarray(answer.normal).ravel()
        slopes = []
        for joint, point in zip(
            self.joints[pair], (answer.getNearestPoint1(), answer.getNearestPoint2()), strict=True
        ):
            wrench = np.concatenate([normal, np.cross(np.asarray(point).ravel() / 1000.0, normal)])
            columns = pin.getJointJacobian(
                self.robot.model, self.data, joint, pin.ReferenceFrame.WORLD
            )
            slopes.append(wrench @ columns if joint else np.zeros(self.robot.model.nv))
        return (slopes[1] - slopes[0])[self.robot.moved]
