"""Figures of data that do not depend on which columns are called base parameters.

With other base parameters C becomes C T. The standard deviation of a predicted torque,
s √(y M⁻¹ yᵀ) with M = CᵀC and y a row of the regressor, stays the same, and so does the share of
the information that a free choice of states could have (`free_design`).
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.excitation.free_design import FreeDesign, free_design
from excite_cli.excitation.problem import Problem, acceleration_bounds
from excite_cli.excitation.reference_states import reference_rows
from excite_cli.excitation.stack import Stack

_SHOWN = 1e-12  # of the energy of effects' columns


@dataclass(frozen=True)
class Invariants:
    """What stacked data tell of torques and of the robot's parameters.

    `torque_deviation`: RMS over random states within the limits (planned for a task: its states),
    and over the measured rows, of the standard deviation of the predicted torque, in units of the
    noise of one sample.
    `efficiency`: the information of an instant as a share of that of the best free choice of
    states, if it was asked for; that choice is known up to the factor exp(`slack`).
    """

    torque_deviation: float
    efficiency: float | None = None
    slack: float | None = None


def invariants(problem: Problem, stack: Stack, design: FreeDesign | None = None) -> Invariants:
    """Figures of all data in `stack`, of which `problem` says what the columns are.

    design: that of `design_for` (seconds), for the efficiency.
    """
    information = _information(problem, stack)
    rows = len(problem.robot.rows)
    deviation = _deviation(problem, stack, information)
    if design is None:
        return Invariants(deviation)
    return Invariants(
        deviation,
        design.efficiency(information, stack.rows / rows),
        design.slack,
    )


def _deviation(problem: Problem, stack: Stack, information: Array) -> float:
    """That of the work, where motions are planned for it; else of the base parameters alone."""
    if problem.prediction is not None:
        return problem.prediction.deviation(stack.factor)
    bounds = acceleration_bounds(problem.spec, problem.robot)
    y = reference_rows(problem.robot, problem.base, bounds, problem.weighting.rows)
    variance = np.einsum("ik,ik->i", y, np.linalg.solve(information, y.T).T)
    return float(np.sqrt(variance.mean()))


def design_for(problem: Problem) -> FreeDesign:
    """The best free choice of states within the limits of the problem's joints."""
    bounds = acceleration_bounds(problem.spec, problem.robot)
    return free_design(problem.robot, problem.base, bounds, problem.weighting.rows)


def _information(problem: Problem, stack: Stack) -> Array:
    """M (r, r) of the base parameters, unscaled; effects are fitted beside them.

    An effect that no motion of the stack shows, as a torque that saturates, takes nothing away.
    """
    factor = stack.factor / problem.column_scales
    whole, rank = factor.T @ factor, problem.base.rank
    own, beside, others = whole[:rank, :rank], whole[:rank, rank:], whole[rank:, rank:]
    if not others.size or problem.prediction is not None:  # effects may be, they need not
        return np.asarray(own)
    sizes = np.sqrt(np.diag(others))
    sizes[sizes == 0.0] = 1.0
    inverse = np.linalg.pinv(others / np.outer(sizes, sizes), _SHOWN, hermitian=True)
    beside = beside / sizes
    return np.asarray(own - beside @ inverse @ beside.T)
