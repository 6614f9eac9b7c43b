"""Torques of the moved joints with the URDF's inertias, and their derivatives."""

from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot


class InverseDynamics:
    """τ(q, v, a) for many samples; not to be shared between threads."""

    def __init__(self, robot: Robot, model: pin.Model | None = None) -> None:
        """`model`: the same robot with other inertias or gravity; None: as the URDF says."""
        self.robot = robot
        self._model = robot.model if model is None else model
        self._data = self._model.createData()

    def _pinocchio_states(self, q: Array, v: Array, a: Array) -> zip:
        robot = self.robot
        return zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """τ (T, n) [N·m or N]."""
        model, data = self._model, self._data
        full = [pin.rnea(model, data, *state).copy() for state in self._pinocchio_states(q, v, a)]
        every = np.array(full).reshape(len(q), model.nv)[:, self.robot.tree.moved]
        return self.robot.gathered(every)

    def derivatives(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """∂τ/∂q, ∂τ/∂v, ∂τ/∂a, each (T, n, n)."""
        by_q, by_v, by_a = rnea_derivatives(
            self._model, self._data, self._pinocchio_states(q, v, a), len(q)
        )
        rows, columns = np.ix_(self.robot.tree.moved, self.robot.tree.moved)
        gathered = self.robot.gathered
        by_joint = (gathered(part[:, rows, columns]) for part in (by_q, by_v, by_a))
        by_q, by_v, by_a = (gathered(part.swapaxes(1, 2)).swapaxes(1, 2) for part in by_joint)
        return by_q, by_v, by_a


def rnea_derivatives(
    model: pin.Model, data: pin.Data, states: Iterable[tuple[Array, Array, Array]], count: int
) -> tuple[Array, Array, Array]:
    """∂τ/∂q, ∂τ/∂v, ∂τ/∂a of all degrees of freedom at `count` states, each (T, nv, nv)."""
    by_q = np.empty((count, model.nv, model.nv))
    by_v, by_a = np.empty_like(by_q), np.empty_like(by_q)
    view_q, view_v, view_a = data.dtau_dq, data.dtau_dv, data.M
    for t, state in enumerate(states):
        pin.computeRNEADerivatives(model, data, *state)
        by_q[t], by_v[t], by_a[t] = view_q, view_v, view_a
    low, high = np.tril_indices(model.nv, -1)  # Pinocchio fills the upper triangle of the mass
    by_a[:, low, high] = by_a[:, high, low]
    return by_q, by_v, by_a
