"""Is the gradient right? Adjoint, the paper's block form and differences on one problem.

The block form covers the base regressor. With effects in the regressor, adjoint and block form are
compared on that part, and the part through the effects' columns is added to both for the comparison
with differences. For these, several steps are then tried and the best is taken: a sign of a speed
bends within 0.02 rad/s and wants small ones, an ill-conditioned motion large ones. A gradient that
is wrong disagrees with all of them.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from excite_cli.dynamics.block_form import block_pull_back
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.start import random_direction
from excite_cli.excitation.task import MotionTask
from excite_cli.robot.model import Array
from excite_cli.shown.answer import Shown

# The finite-difference checker for every derivative in the program.

FORWARD_STEP = 1e-6
CENTRAL_STEP = 1e-5
FOURTH_ORDER_STEP = 3e-5


def forward_differences(
    function: Callable[[Array], float], x: Array, step: float = FORWARD_STEP
) -> Array:
    """∂f/∂x_i ≈ (f(x + h e_i) − f(x)) / h, in the shape of x; the paper's check with h = 1e-6."""
    value = function(x)
    return _each(lambda shifted, h: (function(shifted(h)) - value) / h, x, step)


def central_differences(
    function: Callable[[Array], float], x: Array, step: float = CENTRAL_STEP
) -> Array:
    """∂f/∂x_i ≈ (f(x + h e_i) − f(x − h e_i)) / 2h, in the shape of x."""
    return _each(lambda at, h: (function(at(h)) - function(at(-h))) / (2 * h), x, step)


def fourth_order_differences(
    function: Callable[[Array], float], x: Array, step: float = FOURTH_ORDER_STEP
) -> Array:
    """Central differences on five points: truncation h⁴ allows a large step, hence little noise."""
    return _each(
        lambda at, h: (
            (
                8 * (function(at(h)) - function(at(-h)))
                - (function(at(2 * h)) - function(at(-2 * h)))
            )
            / (12 * h)
        ),
        x,
        step,
    )


def relative_error(found: Array, reference: Array) -> float:
    """‖found − reference‖ / ‖reference‖, zero where both vanish."""
    scale = float(np.linalg.norm(reference))
    difference = float(np.linalg.norm(found - reference))
    return difference / scale if scale > 0 else difference


def _each(
    slope: Callable[[Callable[[float], Array], float], float], x: Array, step: float
) -> Array:
    result = np.empty_like(x)
    for index in np.ndindex(x.shape):

        def at(h: float, index: tuple[int, ...] = index) -> Array:
            shifted = x.copy()
            shifted[index] += h
            return shifted

        result[index] = slope(at, step)
    return result


ADJOINT_BLOCK_LIMIT = 1e-9
CENTRAL_LIMIT = 1e-7
_STEPS_WITH_EFFECTS = (1e-4, FOURTH_ORDER_STEP, 1e-5, 3e-6)
PAPER_FORWARD_ERROR = 1.3e-5


@dataclass(frozen=True, repr=False)
class GradientCheck(Shown):
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
    alpha = task.coefficients(standing + 0.7 * x)

    def cost(coefficients: Array) -> float:
        return objective.value(coefficients, criterion)

    def adjoint() -> Array:
        return objective.value_and_gradient(alpha, criterion)[1]

    def block() -> Array:
        return block_gradient(problem, task, alpha)

    steps = _STEPS_WITH_EFFECTS if objective.extension else (FOURTH_ORDER_STEP,)
    tried = [_timed(partial(fourth_order_differences, cost, alpha, h), 1) for h in steps]
    forward, seconds_forward = _timed(lambda: forward_differences(cost, alpha), 1)
    by_adjoint, seconds_adjoint = _timed(adjoint, repeats)
    by_block, seconds_block = _timed(block, max(2, repeats // 5))
    _, seconds_cost = _timed(lambda: cost(alpha), repeats)
    central, seconds_central = min(tried, key=lambda found: relative_error(by_adjoint, found[0]))
    beside = objective.effect_gradient(alpha, criterion)
    errors = {
        "adjoint_vs_central": relative_error(by_adjoint, central),
        "block_vs_central": relative_error(by_block + beside, central),
        "adjoint_vs_block": relative_error(by_adjoint - beside, by_block),
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
    """Gradient (K, n) by the paper's block form: Z of Eq. 46, then Eqs. 25–40 and 49.

    That part of it that goes through the base regressor.
    """
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
