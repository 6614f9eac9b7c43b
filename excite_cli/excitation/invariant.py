"""Figures of data that do not depend on which columns are called base parameters.

With other base parameters C becomes C T. The standard deviation of a predicted torque,
s √(y M⁻¹ yᵀ) with M = CᵀC and y a row of the regressor, stays the same, and so does the share of
the information that a free choice of states could have (`free_design`).
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.base import Array
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import Regressor
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem, acceleration_bounds
from excite_cli.excitation.weighting import reference_rows, state_bounds
from excite_cli.robot.model import Robot

# What data could tell at best: the D-optimal choice of states within the joint limits.
#
# A design gives weights w_i, Σ w_i = 1, to states (q, v, a) that no trajectory has to connect.
# With its information M = Σ w_i Y_iᵀ Y_i of one instant, det M is the greatest where no state has
# a sensitivity d = tr(M⁻¹ Y(x)ᵀ Y(x)) above r, the number of parameters (Kiefer and Wolfowitz
# 1960). Weights are found by Titterington's multiplication w_i ← w_i d_i / r, states by moving
# those that d asks for. The efficiency of motions is (det(M/T) / det M*)^(1/r), with T instants:
# a share that does not depend on which columns are called base parameters.

_DRAWN, _ROUNDS, _ITERATIONS = 1000, 6, 60
# Of the drawn values this share is at a bound: information is greatest there.
_AT_BOUNDS = 0.7
_UNUSED = 1e-7
_MOVED, _TRIES = 60, 12


@dataclass(frozen=True)
class FreeDesign:
    """Information (r, r) of one instant, and by how much the best could exceed it.

    `slack`: max d / r − 1 over its own states and those tried last; det M^(1/r) of any design over
    them is at most exp(slack) times that of this one (log det is concave).
    """

    information: Array
    slack: float

    def efficiency(self, information: Array, instants: float) -> float:
        """Share (0 to 1) of the information of the best design, of `information` of so many."""
        sign, own = np.linalg.slogdet(information / instants)
        _, best = np.linalg.slogdet(self.information)
        return float(np.exp((own - best) / len(information))) if sign > 0 else 0.0


def free_design(
    robot: Robot, base: BaseParameters, accelerations: Array, rows: Array
) -> FreeDesign:
    """The design over states within the limits of position, speed and `accelerations` (n,).

    rows: weights (R,) of the measured rows. Bounds that are infinite count as those that states
    are drawn from.
    """
    rng = np.random.default_rng(0)
    lower, upper = state_bounds(robot, accelerations)
    states = _drawn(rng, lower, upper, _DRAWN)
    regressor = Regressor(robot)

    def rows_of(states: Array) -> Array:
        q, v, a = np.split(states, 3, axis=1)
        y = regressor.evaluate(q, v, a)[:, :, base.selection] * rows[:, None]
        return np.asarray(y)

    y, weights = rows_of(states), np.full(_DRAWN, 1.0 / _DRAWN)
    slack = np.inf
    for round_ in range(_ROUNDS):
        for _ in range(_ITERATIONS):
            weights = weights * _sensitivity(y, _design_information(y, weights)) / base.rank
            weights /= weights.sum()
        used = weights > _UNUSED
        states, y, weights = states[used], y[used], weights[used] / weights[used].sum()
        information = _design_information(y, weights)
        moved = _moved(rng, states, weights, lower, upper)
        there = rows_of(moved)
        gain = _sensitivity(there, information)
        slack = max(float(gain.max()), float(_sensitivity(y, information).max())) / base.rank - 1.0
        better = np.argsort(-gain)[: len(states)]
        better = better[gain[better] > base.rank]
        if round_ == _ROUNDS - 1 or not len(better):
            break
        share = 0.1 / len(better)
        states = np.concatenate([states, moved[better]])
        y = np.concatenate([y, there[better]])
        weights = np.concatenate([0.9 * weights, np.full(len(better), share)])
    return FreeDesign(information, max(slack, 0.0))


def _design_information(y: Array, weights: Array) -> Array:
    rows = y * np.sqrt(weights)[:, None, None]
    flat = rows.reshape(-1, y.shape[2])
    return np.asarray(flat.T @ flat)


def _sensitivity(y: Array, information: Array) -> Array:
    """d (N,) = tr(M⁻¹ Yᵀ Y) of states' rows (N, R, r)."""
    factor = np.linalg.cholesky(information)
    white = np.linalg.solve(factor, y.reshape(-1, y.shape[2]).T)
    return np.asarray(np.square(white).sum(axis=0).reshape(y.shape[:2]).sum(axis=1))


def _drawn(rng: np.random.Generator, lower: Array, upper: Array, count: int) -> Array:
    """States (count, 3 n): positions anywhere, speeds and accelerations often at a bound."""
    n = len(lower) // 3
    share = rng.uniform(size=(count, 3 * n))
    ends = rng.uniform(size=share.shape) < _AT_BOUNDS
    ends[:, :n] = False
    share = np.where(ends, np.round(share), share)
    return np.asarray(lower + share * (upper - lower))


def _moved(
    rng: np.random.Generator, states: Array, weights: Array, lower: Array, upper: Array
) -> Array:
    """The weightiest states with some of their values changed."""
    best = states[np.argsort(-weights)[:_MOVED]]
    many = np.repeat(best, _TRIES, axis=0)
    size = rng.choice([0.03, 0.2, 1.0], size=(len(many), 1))
    step = size * (upper - lower) * rng.normal(size=many.shape)
    which = rng.uniform(size=many.shape) < 0.2
    return np.asarray(np.clip(many + np.where(which, step, 0.0), lower, upper))


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
