"""The regressor Y(q, v, a) of Eq. 1: Y φ = τ, ten standard parameters per body.

φ has Pinocchio's order per body: m, m c (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the joint frame.
"""

from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

# Torques of the moved joints with the URDF's inertias, and their derivatives.


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


PARAMETERS_PER_BODY = 10
PARAMETER_NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_UNITS = ("kg", *["kg·m"] * 3, *["kg·m²"] * 6)


class Regressor:
    """Evaluates Y for many samples; not to be shared between threads."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._data = robot.model.createData()
        self._all_rows = len(robot.tree.rows) == robot.model.nv

    def evaluate(self, q: Array, v: Array, a: Array) -> Array:
        """Y for the measured rows.

        Parameters
        ----------
        q, v, a: (T, n) of the moved joints

        Returns
        -------
        (T, R, 10·n_bodies) with R measured rows
        """
        robot = self.robot
        model, data, compute = robot.model, self._data, pin.computeJointTorqueRegressor
        qs, vs, accelerations = map(
            list, (robot.configurations(q), robot.velocities(v), robot.velocities(a))
        )
        full = np.empty((len(q), model.nv, PARAMETERS_PER_BODY * robot.n_bodies))
        for t, (qt, vt, at) in enumerate(zip(qs, vs, accelerations, strict=True)):
            full[t] = compute(model, data, qt, vt, at)
        full[:, :, : PARAMETERS_PER_BODY * robot.massless] = 0.0
        return robot.gathered_rows(full if self._all_rows else full[:, robot.tree.rows])


def standard_parameters(robot: Robot) -> Array:
    """φ (10·n_bodies,) of the URDF's inertias and the payload's."""
    return np.concatenate(
        [robot.model.inertias[body].toDynamicParameters() for body in range(1, robot.model.njoints)]
    )


def payload_parameters(robot: Robot) -> Array:
    """The part of φ (10·n_bodies,) that is the payload's; zero without one."""
    phi = np.zeros((robot.n_bodies + 1, PARAMETERS_PER_BODY))
    if robot.payload is not None:
        phi[robot.payload.capsule.joint] = robot.payload.phi
    return phi[1:].ravel()


def standard_parameter_unit(index: int) -> str:
    """The unit of φ_index."""
    return _UNITS[index % PARAMETERS_PER_BODY]


def standard_parameter_names(robot: Robot) -> tuple[str, ...]:
    """Names such as `m[arm_left_1_joint]`, in the order of φ."""
    bodies = [str(name) for name in robot.model.names[1:]]
    return tuple(f"{symbol}[{body}]" for body in bodies for symbol in PARAMETER_NAMES)
