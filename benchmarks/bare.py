"""The floor: only the Pinocchio and LAPACK calls that cost and gradient cannot do without.

Per sample one joint-torque regressor and three RNEA-derivative passes (two singular pairs and the
reference inertia), then QR of the stacked base regressor and SVD of its triangle. Nothing is
copied out, weighted or pulled back; inputs are prepared beforehand.
"""

import numpy as np
import pinocchio as pin
from scipy.linalg import lapack

from excite_cli.excitation.problem import Problem


class BareCalls:
    """The library calls of one cost and gradient on a problem."""

    def __init__(self, problem: Problem, coefficients: np.ndarray) -> None:
        robot = problem.robot
        q, v, a = problem.cost_basis.states(coefficients)
        self._states = list(
            zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)
        )
        self._model, self._data = robot.model, robot.model.createData()
        self._block = np.asfortranarray(problem.objective().block(coefficients))
        self._rank = problem.base.rank

    def run(self) -> None:
        """All calls once."""
        model, data = self._model, self._data
        for state in self._states:
            pin.computeJointTorqueRegressor(model, data, *state)
        for _ in range(3):
            for state in self._states:
                pin.computeRNEADerivatives(model, data, *state)
        packed = lapack.dgeqrf(self._block)[0]
        lapack.dgesdd(np.triu(packed[: self._rank]))
