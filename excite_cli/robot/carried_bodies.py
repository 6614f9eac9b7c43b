"""Which joints carry which bodies, and which move two bodies against each other."""

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.model import Robot

Array = NDArray[np.float64]


def carried_bodies(robot: Robot) -> Array:
    """(njoints, m) of 0 and 1: does joint k of `robot.tree` carry what hangs on a model's joint?"""
    model, first = robot.model, robot.first_joint
    carried = np.zeros((model.njoints, robot.tree.n))
    for joint in range(1, model.njoints):
        carried[joint] = carried[model.parents[joint]]
        if joint >= first:
            carried[joint, joint - first] = 1.0
    return carried


class MovedBodies:
    """Which moved joints (n,) move a body, by themselves or by the joints that follow them."""

    def __init__(self, robot: Robot) -> None:
        self._carried = carried_bodies(robot)
        self._coupling = robot.coupling

    def moving(self, joint: int) -> NDArray[np.intp]:
        """Those that move what hangs on a joint of the model."""
        return self._own(self._carried[joint])

    def between(self, first: int, second: int) -> NDArray[np.intp]:
        """Those that move what hangs on two joints of the model against each other."""
        return self._own(np.abs(self._carried[first] - self._carried[second]))

    def _own(self, chosen: Array) -> NDArray[np.intp]:
        if self._coupling is not None:
            chosen = chosen @ np.abs(self._coupling.matrix)
        return np.flatnonzero(chosen)
