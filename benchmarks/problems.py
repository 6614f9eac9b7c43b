"""What timing benchmarks share: problems, a motion, a floor to compare with, a stopwatch."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.linalg import lapack

from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.start import random_direction
from excite_cli.excitation.task import MotionTask

CONFIGS = Path(__file__).parents[1] / "configs"
WITHOUT_GEOMETRY = "constraints.self_collision=null"


def problem(name: str, *overrides: str) -> Problem:
    """A shipped config by its stem, with overrides."""
    path = CONFIGS / f"{name}.yaml"
    return build_problem(load_spec(path, list(overrides)), path.parent)


def motion(of: Problem, seed: int = 0) -> np.ndarray:
    """Coefficients of a seeded random motion of about the range of the joint bounds."""
    task = MotionTask(of)
    standing = task.variables(of.still(of.robot.posture))
    return task.coefficients(standing + 0.7 * random_direction(task, np.random.default_rng(seed)))


def interleaved(functions: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median seconds of each function, run A B C A B C … after one warm-up.

    On a noisy machine only ratios from the same run count.
    """
    for function in functions.values():
        function()
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(repeats):
        for name, function in functions.items():
            began = time.perf_counter()
            function()
            seconds[name].append(time.perf_counter() - began)
    return {name: float(np.median(values)) for name, values in seconds.items()}


class BareCalls:
    """The floor: only the library calls that cost and gradient of a problem cannot do without.

    Per sample one joint-torque regressor and three RNEA-derivative passes (two singular pairs and
    the reference inertia), then QR of the stacked base regressor and SVD of its triangle. Nothing
    is copied out, weighted or pulled back; inputs are prepared beforehand.
    """

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
