"""The best admissible point of a solver whose iterates may leave the admissible set.

What is left at the end is pulled back by the least change that mends the broken rows to first
order (Lawson and Hanson 1974), or towards the last admissible point.
"""

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from excite_cli.constraints.base import Array
from excite_cli.excitation.objective import Spectrum
from excite_cli.excitation.solvers.linearised import Linearised, Mask, dips, gathered, lowest
from excite_cli.excitation.task import MotionTask

_RESTORATIONS = 10
# Least residual aimed at, and the residual below which a dip is mended.
_AIM, _NEAR = 1e-4, 0.05


def least_distance(rows: Array, bounds: Array) -> Array | None:
    """The shortest y with rows·y ≥ bounds; None if there is none.

    Dual of a non-negative least-squares problem (Lawson and Hanson 1974, algorithm LDP), so it
    needs no library for quadratic programs.
    """
    system = np.vstack([rows.T, bounds])
    target = np.append(np.zeros(rows.shape[1]), 1.0)
    try:
        weights, _ = nnls(system, target)
    except RuntimeError:  # its iteration limit
        return None
    residual = system @ weights - target
    if residual[-1] > -1e-12:
        return None
    return np.asarray(-residual[:-1] / residual[-1])


def corrected(task: MotionTask, x: Array, aim: float = _AIM, enough: float = 0.0) -> Array | None:
    """x with the least corrections, in the metric of the task, that mend its linearised residuals.

    `aim` is the residual wanted of the rows that are mended. None where some stay below `enough`;
    rows that no change of x can mend (given ends) need only be positive.
    """
    factor = np.linalg.cholesky(
        task.metric + 1e-9 * np.trace(task.metric) / task.size * np.eye(task.size)
    )
    near_below = max(_NEAR, 2.0 * aim)
    given = np.isclose(np.abs(task.residuals.grid.orders[0]).max(axis=1), 0.0, atol=1e-9)
    chosen: list[Mask] | None = None
    for _ in range(_RESTORATIONS):
        states = task.states(x)
        values = task.values(states)
        if lowest(values) > 0 and lowest([value[~given] for value in values]) > enough:
            return x
        near = [(value < near_below) & dips(value) & ~given[:, None] for value in values]
        chosen = [a | b for a, b in zip(chosen or near, near, strict=True)]
        rows = Linearised(task, states, values, chosen).dense(chosen)
        scaled = solve_triangular(factor, rows.T, lower=True).T
        correction = least_distance(scaled, aim - gathered(values, chosen))
        if correction is None:
            return None
        x = x + solve_triangular(factor, correction, lower=True, trans="T")
        aim *= 1.5
    return None


class BestAdmissible:
    """The best strictly admissible point seen, by the criterion asked for."""

    def __init__(self, task: MotionTask) -> None:
        self.task = task
        self.x: Array | None = None
        self.cost = np.inf

    def offer(self, x: Array, values: list[Array], spectrum: Spectrum) -> None:
        """Keep x if it is strictly admissible and better than what is kept."""
        cost = self.task.problem.criterion.value(spectrum.sigma)
        if lowest(values) > 0 and (cost < self.cost or self.x is None):
            self.x, self.cost = x.copy(), cost

    def kept(self) -> Array:
        """The point itself; there is one as soon as an admissible start was offered."""
        assert self.x is not None, "a solver starts from an admissible point"
        return self.x

    def offer_restored(self, x: Array) -> None:
        """Offer the admissible point that least-length corrections or a retreat make of x."""
        candidate = corrected(self.task, x)
        if candidate is None:
            candidate = self._retreated(x)
        self.task.evaluations += 1
        objective = self.task.objective
        block = objective.block(self.task.coefficients(candidate))
        values = self.task.values(self.task.states(candidate))
        self.offer(candidate, values, objective.spectrum(block))

    def _retreated(self, x: Array) -> Array:
        """A point on the way from the kept point to x, as far along as bisection proves."""
        inside, outside = 0.0, 1.0
        start = self.kept()
        for _ in range(12):
            middle = 0.5 * (inside + outside)
            values = self.task.values(self.task.states(start + middle * (x - start)))
            if lowest(values) > 0:
                inside = middle
            else:
                outside = middle
        return start + inside * (x - start)
