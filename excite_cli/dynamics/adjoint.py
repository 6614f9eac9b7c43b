"""Vector–Jacobian product of the regressor by inverse dynamics with fictitious inertias.

For one sample and one pair (u, φ), uᵀ Y(x) φ = uᵀ ID(x; φ): the regressor times a vector is the
inverse dynamics of a robot with inertias φ. So the derivative of Σ_k u_kᵀ Y φ_k needs no derivative
of the regressor, only one RNEA-derivatives pass per pair:

    ∂/∂x = Σ_k u_kᵀ ∂ID(x; φ_k)/∂x.

Pinocchio stores a body as (m, c, I_c), which breaks down for m ≈ 0. ID is linear in φ, so a shift
is free of error where it can be told apart or does not show:
- a direction d of the standard parameters that no torque shows (Y d = 0, masses all non-zero, from
  the base parameters' grouping) may be added outright: ID(·; φ + s d) = ID(·; φ);
- without one, ID(·; φ) = ID(·; φ + s φ_ref) − s ID(·; φ_ref) with a fixed unit inertia φ_ref, the
  second pass being shared by all pairs.
"""

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from excite_cli.robot.model import Array, Robot

_REFERENCE = np.array([1.0, 0, 0, 0, 1.0, 0, 1.0, 0, 0, 1.0])


class FictitiousInertiaAdjoint:
    """Few singular pairs (the condition number has two); not to be shared between threads."""

    def __init__(self, robot: Robot, silent: Array | None = None) -> None:
        """`silent`: a direction (P,) with Y d = 0 (`BaseParameters.silent_direction`), if any."""
        self.robot = robot
        self._model = robot.model.copy()
        self._data = self._model.createData()
        self._silent = silent if silent is not None and _shifts_every_mass(silent) else None

    def pull_back(
        self, q: Array, v: Array, a: Array, left: Array, right: Array
    ) -> tuple[Array, Array, Array]:
        """Derivative of Σ_k Σ_t left_ktᵀ Y(x_t) right_k with respect to x_t.

        Parameters
        ----------
        q, v, a: (T, n) of the moved joints
        left: (K, T, R) one vector per pair, sample and measured row
        right: (K, P) fictitious standard parameters

        Returns
        -------
        gq, gv, ga, each (T, n)
        """
        robot = self.robot
        states = list(
            zip(robot.configurations(q), robot.velocities(v), robot.velocities(a), strict=True)
        )
        total = np.zeros((3, len(q), self._model.nv))
        for weight, inertias in self._passes(left, right):
            self._add_pass(total, states, weight, inertias.reshape(-1, 10))
        gq, gv, ga = (robot.gathered(part[:, robot.tree.moved]) for part in total)
        return gq, gv, ga

    def _passes(self, left: Array, right: Array) -> Iterator[tuple[Array, Array]]:
        """Weights (T, nv) and standard parameters (P,) of each RNEA-derivatives pass."""
        reference = np.tile(_REFERENCE, self.robot.n_bodies)
        direction = reference if self._silent is None else self._silent
        # Twice the largest entry: the shifted masses stay well away from zero.
        least = np.abs(direction[::10]).min()
        shift = (2.0 * np.abs(right).max(axis=1) + 1e-300) / least
        weights = np.zeros((*left.shape[:2], self._model.nv))
        for weight, rows in zip(weights, left, strict=True):
            weight[:, self.robot.tree.rows] = self.robot.spread_rows(rows)
        yield from zip(weights, right + shift[:, None] * direction, strict=True)
        if self._silent is None:
            yield -np.einsum("k,ktr->tr", shift, weights), reference

    def _add_pass(self, total: Array, states: list, weight: Array, inertias: Array) -> None:
        model, data, compute = self._model, self._data, pin.computeRNEADerivatives
        for body, parameters in enumerate(inertias, start=1):
            model.inertias[body] = pin.Inertia.FromDynamicParameters(parameters)
        by_q = np.empty((len(states), model.nv, model.nv))
        by_v, by_a = np.empty_like(by_q), np.empty_like(by_q)
        view_q, view_v, view_a = data.dtau_dq, data.dtau_dv, data.M
        for t, (qt, vt, at) in enumerate(states):
            compute(model, data, qt, vt, at)
            by_q[t] = view_q
            by_v[t] = view_v
            by_a[t] = view_a
        row = weight[:, None, :]
        total[0] += (row @ by_q)[:, 0]
        total[1] += (row @ by_v)[:, 0]
        # Pinocchio fills only the upper triangle of the mass matrix.
        upper = np.triu(by_a)
        total[2] += (row @ upper)[:, 0] + (upper @ weight[:, :, None])[:, :, 0]
        total[2] -= weight * np.einsum("tii->ti", by_a)


def _shifts_every_mass(direction: Array) -> bool:
    masses = np.abs(direction[::10])
    return bool(masses.min() > 0.05 * np.abs(direction).max())
