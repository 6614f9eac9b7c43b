"""The least change of a motion that repairs its broken residuals to first order.

Rows that need repair are few: the dips in time of residuals near zero. The shortest change that
lifts them, in the metric of the task, is a least-distance problem (Lawson and Hanson 1974).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from excite_cli.constraints.base import Array
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.task import MotionTask

Mask = NDArray[np.bool_]

_ROUNDS = 10
# Least residual aimed at, and the residual below which a dip is repaired.
_AIM, _NEAR = 1e-4, 0.05


def corrected(task: MotionTask, x: Array, aim: float = _AIM, enough: float = 0.0) -> Array | None:
    """x with the least corrections, in the metric of the task, that repair linearised residuals.

    `aim` is the residual wanted of the rows that are repaired. None where some stay below `enough`;
    rows that no change of x can repair (given ends) need only be positive.
    """
    factor = np.linalg.cholesky(
        task.metric + 1e-9 * np.trace(task.metric) / task.size * np.eye(task.size)
    )
    near_below = max(_NEAR, 2.0 * aim)
    given = np.isclose(np.abs(task.residuals.grid.orders[0]).max(axis=1), 0.0, atol=1e-9)
    chosen: list[Mask] | None = None
    for _ in range(_ROUNDS):
        states = task.states(x)
        values = task.values(states)
        if lowest(values) > 0 and lowest([value[~given] for value in values]) > enough:
            return x
        near = [(value < near_below) & dips(value) & ~given[:, None] for value in values]
        chosen = [a | b for a, b in zip(chosen or near, near, strict=True)]
        rows = chosen_rows(task, states, chosen)
        scaled = solve_triangular(factor, rows.T, lower=True).T
        correction = least_distance(scaled, aim - gathered(values, chosen))
        if correction is None:
            return None
        x = x + solve_triangular(factor, correction, lower=True, trans="T")
        aim *= 1.5
    return None


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


def chosen_rows(task: MotionTask, states: States, chosen: list[Mask]) -> Array:
    """Derivatives (K, size) of the residuals where `chosen` (T, m), in the order of `gathered`."""
    orders, blocks = task.residuals.grid.orders, [np.zeros((0, task.size))]
    for index, mask in enumerate(chosen):
        rows = task.residuals.rows(states, index, mask)
        block = np.zeros((len(rows.times), task.n, task.k))
        for part, order in zip(rows.parts, orders, strict=True):
            if part is not None:
                block += part[:, :, None] * order[rows.times][:, None, :]
        blocks.append(block.reshape(len(rows.times), task.size))
    return np.vstack(blocks)


def gathered(values: list[Array], chosen: list[Mask]) -> Array:
    """The chosen entries of all constraints in one vector."""
    picked = [value[mask] for value, mask in zip(values, chosen, strict=True)]
    return np.concatenate([np.zeros(0), *picked])


def dips(value: Array) -> Mask:
    """Where each column of (T, m) is not above its neighbours in time."""
    padded = np.pad(value, ((1, 1), (0, 0)), constant_values=np.inf)
    return np.asarray((value <= padded[:-2]) & (value <= padded[2:]))


def lowest(values: list[Array]) -> float:
    """The smallest residual of all."""
    return min((float(value.min()) for value in values), default=np.inf)
