"""Residuals to first order about a point: rows to choose, to stack, and to predict with."""

import numpy as np
from numpy.typing import NDArray

from excite_cli.constraints.base import Array
from excite_cli.constraints.joint_bound import JointBound
from excite_cli.dynamics.states import States
from excite_cli.excitation.residuals import REACH, Rows
from excite_cli.excitation.task import MotionTask

Mask = NDArray[np.bool_]


class Linearised:
    """Residuals to first order about a point; derivatives only where `near` is true."""

    def __init__(
        self,
        task: MotionTask,
        states: States,
        values: list[Array],
        near: list[Mask] | None = None,
    ) -> None:
        self.task, self.values = task, values
        self.near = near or [
            np.ones_like(value, dtype=bool) if isinstance(constraint, JointBound)
            else value < REACH
            for constraint, value in zip(task.problem.constraints, values, strict=True)
        ]  # fmt: skip
        self.rows: list[Rows | None] = [
            None if isinstance(c, JointBound) else task.residuals.rows(states, i, self.near[i])
            for i, c in enumerate(task.problem.constraints)
        ]

    def change(self, direction: Array) -> list[Array]:
        """J d as (T, m) per constraint, zero where nothing was linearised."""
        task = self.task
        by_order = [
            order @ direction.reshape(task.n, task.k).T for order in task.residuals.grid.orders
        ]
        found = []
        for index, constraint in enumerate(task.problem.constraints):
            change, rows = np.zeros_like(self.values[index]), self.rows[index]
            if isinstance(constraint, JointBound):
                per_joint = by_order[constraint.order][:, constraint.joints]
                change = per_joint * (-constraint.signs / constraint.scale)
            elif rows is not None:
                total = np.zeros(len(rows.times))
                for part, order in zip(rows.parts, by_order, strict=True):
                    if part is not None:
                        total += np.einsum("kn,kn->k", part, order[rows.times])
                change[self.near[index]] = total
            found.append(change)
        return found

    def dense(self, chosen: list[Mask]) -> Array:
        """Rows of J where `chosen` (T, m) per constraint is true, in the order of `gathered`."""
        task, orders = self.task, self.task.residuals.grid.orders
        blocks = [np.zeros((0, task.size))]
        for index, constraint in enumerate(task.problem.constraints):
            times, columns = np.nonzero(chosen[index])
            block = np.zeros((len(times), task.n, task.k))
            rows = self.rows[index]
            if isinstance(constraint, JointBound):
                weights = -(constraint.signs / constraint.scale)[columns]
                block[np.arange(len(times)), constraint.joints[columns]] = (
                    weights[:, None] * orders[constraint.order][times]
                )
            elif rows is not None:
                at = np.flatnonzero(chosen[index][self.near[index]])
                for part, order in zip(rows.parts, orders, strict=True):
                    if part is not None:
                        block += part[at][:, :, None] * order[times][:, None, :]
            blocks.append(block.reshape(len(times), task.size))
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
