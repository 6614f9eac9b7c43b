"""Is the gradient right? Adjoint, the paper's block form and differences on one problem."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from excite_cli.excitation.differences import (
    forward_differences,
    fourth_order_differences,
    relative_error,
)
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import random_direction
from excite_cli.excitation.task import MotionTask
from excite_cli.robot.block_form import block_pull_back
from excite_cli.robot.model import Array

ADJOINT_BLOCK_LIMIT = 1e-9
CENTRAL_LIMIT = 1e-7
PAPER_FORWARD_ERROR = 1.3e-5


@dataclass(frozen=True)
class GradientCheck:
    """Relative errors and seconds of the three ways, and whether the limits are kept."""

    variables: int
    samples: int
    base_parameters: int
    condition_number: float
    relative_error: dict[str, float]
    seconds: dict[str, float]
    passed: bool


def check_gradient(
    problem: Problem, seed: int = 0, stack: Stack | None = None, repeats: int = 20
) -> GradientCheck:
    """Compare all gradients of the problem's criterion at a seeded random motion.

    The motion uses about the range of the joint bounds; it need not be admissible.
    """
    task = MotionTask(problem, stack)
    objective, criterion = task.objective, problem.criterion
    x = random_direction(task, np.random.default_rng(seed))
    standing = task.variables(problem.still(problem.robot.posture))
    alpha = problem.trajectory.free_directions @ ((standing + 0.7 * x).reshape(task.n, task.k).T)

    def cost(coefficients: Array) -> float:
        return objective.value(coefficients, criterion)

    def adjoint() -> Array:
        return objective.value_and_gradient(alpha, criterion)[1]

    def block() -> Array:
        return block_gradient(problem, task, alpha)

    central, seconds_central = _timed(lambda: fourth_order_differences(cost, alpha), 1)
    forward, seconds_forward = _timed(lambda: forward_differences(cost, alpha), 1)
    by_adjoint, seconds_adjoint = _timed(adjoint, repeats)
    by_block, seconds_block = _timed(block, max(2, repeats // 5))
    _, seconds_cost = _timed(lambda: cost(alpha), repeats)
    errors = {
        "adjoint_vs_central": relative_error(by_adjoint, central),
        "block_vs_central": relative_error(by_block, central),
        "adjoint_vs_block": relative_error(by_adjoint, by_block),
        "adjoint_vs_forward": relative_error(by_adjoint, forward),
    }
    return GradientCheck(
        variables=problem.variables,
        samples=len(problem.cost_basis.times),
        base_parameters=problem.base.rank,
        condition_number=objective.stacked_condition_number(alpha),
        relative_error=errors,
        seconds={
            "cost": seconds_cost,
            "adjoint": seconds_adjoint,
            "block": seconds_block,
            "forward": seconds_forward,
            "central": seconds_central,
        },
        passed=errors["adjoint_vs_block"] <= ADJOINT_BLOCK_LIMIT
        and max(errors["adjoint_vs_central"], errors["block_vs_central"]) <= CENTRAL_LIMIT,
    )


def block_gradient(problem: Problem, task: MotionTask, alpha: Array) -> Array:
    """Gradient (K, n) by the paper's block form: Z of Eq. 46, then Eqs. 25–40 and 49."""
    objective = task.objective
    matrix = objective.block(alpha)
    left, right = objective.pairs(matrix, objective.spectrum(matrix), problem.criterion)
    z = left.transpose(1, 2, 0) @ right
    q, v, a = problem.cost_basis.states(alpha)
    return problem.cost_basis.pull_back(*block_pull_back(problem.robot, q, v, a, z))


def _timed(function: Callable[[], Array | float], repeats: int) -> tuple[Array, float]:
    """Result and median seconds."""
    seconds, result = [], None
    for _ in range(repeats):
        began = time.perf_counter()
        result = function()
        seconds.append(time.perf_counter() - began)
    return np.asarray(result), float(np.median(seconds))
