"""Limits of motors that drive several joints together (`robot.transmissions`).

With q = T θ, motors stand at θ = T⁻¹ q, which is linear in the joints, and give τ_motor = Tᵀ τ. A
motor that drives a joint alone is bounded with that joint.
"""

from dataclasses import replace

import numpy as np

from excite_cli.constraints.base import Array, Constraint, Indices, Parts, part_of
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.regressor import InverseDynamics, Regressor
from excite_cli.dynamics.row_adjoint import RowAdjoint
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.measurement.motors import Motors
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.enclosed_rows import combined, least_of, torque_rows
from excite_cli.robot.model import Robot

ORDERS = ("position", "velocity", "acceleration", "jerk")
UNITS = ("rad", "rad/s", "rad/s²", "rad/s³")


class _Sides:
    """Both sides of every motor that is bounded: margin = bound − sign·value; all (m,)."""

    def __init__(self, motors: Motors, lower: Array, upper: Array) -> None:
        low, high = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.motors = np.concatenate([low, high])
        self.signs = np.concatenate([-np.ones(len(low)), np.ones(len(high))])
        self.bounds = np.concatenate([-lower[low], upper[high]])
        half = np.where(np.isfinite(upper - lower), (upper - lower) / 2, 1.0)
        self.scale = half[self.motors]
        sides = [*["lower"] * len(low), *["upper"] * len(high)]
        self.labels = tuple(
            f"{motors.names[j]} {side}" for j, side in zip(self.motors, sides, strict=True)
        )


class MotorBound(Constraint):
    """lower ≤ x ≤ upper for the derivative of the given order (0 to 3) of the motors' positions.

    `lower`, `upper` (n,), infinite where there is none.
    """

    def __init__(self, motors: Motors, order: int, lower: Array, upper: Array) -> None:
        self._sides, self._order = _Sides(motors, lower, upper), order
        self.name, self.unit = f"motor_{ORDERS[order]}", UNITS[order]
        self.labels, self.scale = self._sides.labels, self._sides.scale
        back = np.linalg.inv(motors.matrix)[self._sides.motors]
        self._slopes = self._sides.signs[:, None] * back  # (m, n): signed motor by joint

    @property
    def title(self) -> str:
        """Says which quantity."""
        return f"Motor {ORDERS[self._order]} to its limit"

    def margins(self, states: States) -> Array:
        """Distance to each bound (T, m)."""
        return np.asarray(self._sides.bounds - states.order(self._order) @ self._slopes.T)

    def least(self, motion: EnclosedMotion) -> Array:
        """bound − the most that the signed quantity can be (T, m)."""
        x = motion.states.order(self._order)
        return np.asarray(self._sides.bounds - x.through(self._slopes).upper())

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """The same at all instants."""
        return part_of(self._order, -self._slopes[columns])


class MotorTorque(Constraint):
    """|Tᵀ τ| ≤ limit of every bounded motor, for the URDF's inertias or all that are admitted."""

    name = "motor_torque"
    of_forces = True
    title = "Motor torque left"
    unit = "N·m"

    def __init__(
        self, robot: Robot, limits: Array, uncertainty: InertiaUncertainty | None = None
    ) -> None:
        assert robot.motors is not None
        self._sides = _Sides(robot.motors, -limits, limits)
        self.labels, self.scale = self._sides.labels, self._sides.scale
        self._functionals = robot.motors.matrix.T[self._sides.motors]  # (m, n): motor by joint
        self._dynamics = InverseDynamics(robot)
        self._regressor = Regressor(replace(robot, rows=robot.moved))
        self._adjoint = RowAdjoint(robot)
        self.uncertainty = uncertainty
        self._admitted = (uncertainty or InertiaUncertainty.none(robot)).of_moving_bodies()

    @property
    def _signed(self) -> Array:
        return self._sides.signs[:, None] * self._functionals

    def margins(self, states: States) -> Array:
        """limit − |torque of the motor| on either side (T, m), the least over the inertias."""
        q, v, a = states.q, states.v, states.a
        if self.uncertainty is None:
            return np.asarray(self._sides.bounds - self._dynamics.torques(q, v, a) @ self._signed.T)
        half = len(self._functionals) // 2
        rows = self._functionals[:half] @ self._regressor.evaluate(q, v, a)
        lower, upper = self._admitted.least_both(rows)
        return np.asarray(self._sides.bounds + np.hstack([lower, upper]))

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on what is left on either side (T, m), for every admitted inertia."""
        rows = combined(-self._signed, torque_rows(motion))
        return np.asarray(self._sides.bounds + least_of(rows, self._admitted))

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Sums of rows of the inverse-dynamics derivatives, with the worst inertias of each."""
        q, v, a = states.q, states.v, states.a
        instants, inverse = np.unique(times, return_inverse=True)
        along = -self._signed[columns]
        if self.uncertainty is None:
            parts = self._dynamics.derivatives(q[instants], v[instants], a[instants])
            by_q, by_v, by_a = (np.einsum("kj,kjn->kn", along, part[inverse]) for part in parts)
            return by_q, by_v, by_a
        rows = self._regressor.evaluate(q[instants], v[instants], a[instants])[inverse]
        phi = self._admitted.worst(np.einsum("kj,kjp->kp", along, rows))
        found = [np.zeros((len(times), q.shape[1])) for _ in range(3)]
        for joint in np.flatnonzero(along.any(axis=0)):
            each = np.full(len(times), joint)
            shares = along[:, joint, None]
            for whole, part in zip(
                found, self._adjoint.torques(q, v, a, times, each, shares * phi), strict=True
            ):
                whole += part
        return found[0], found[1], found[2]
