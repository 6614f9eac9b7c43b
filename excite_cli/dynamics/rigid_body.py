"""Rigid-body torque and its parts at given standard parameters φ, for many samples.

What effects are made of: the load of every joint, its derivatives, the columns of single bodies,
the torque of gravity along each axis of the world, and the Jacobian of the last body. Everything is
computed once, at first use.
"""

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, InverseDynamics, Regressor
from excite_cli.robot.model import Array, Robot

# φ₁ of every body: 1 kg and 1 kg·m² at its frame.
_BALL = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0])


def robot_with(robot: Robot, phi: Array) -> pin.Model:
    """A copy of the model whose inertias are φ (10·n_bodies,); φ need not be consistent."""
    model = robot.model.copy()
    for body in range(1, model.njoints):
        ten = np.asarray(phi[PARAMETERS_PER_BODY * (body - 1) : PARAMETERS_PER_BODY * body])
        model.inertias[body] = _inertia(ten)
    return model


def _inertia(ten: Array) -> pin.Inertia:
    """An inertia from any ten numbers: a fit may leave the consistent ones."""
    ten = np.array(ten, dtype=float)
    if abs(ten[0]) < 1e-9:  # the lever is first moment over mass
        ten[0] = 1e-9
    return pin.Inertia.FromDynamicParameters(ten)


class RigidBody:
    """The rigid-body part of a motion q, v, a (T, n) at φ (10·n_bodies,); rows are moved joints.

    `model`: that of `robot_with(robot, phi)`, for those who evaluate many motions at one φ.
    """

    def __init__(
        self,
        robot: Robot,
        phi: Array,
        q: Array,
        v: Array,
        a: Array,
        model: pin.Model | None = None,
    ) -> None:
        self.robot, self.phi = robot, np.asarray(phi, dtype=float)
        self.q, self.v, self.a = q, v, a
        self._given = model

    def __getstate__(self) -> dict[str, Any]:
        """Without what can be computed again."""
        derived = ("regressor", "_derivatives", "gravity_axes", "_model", "_given")
        own = {key: value for key, value in self.__dict__.items() if key not in derived}
        return {**own, "_given": None}

    def cut(self, at: slice) -> "RigidBody":
        """Some of the samples."""
        return RigidBody(self.robot, self.phi, self.q[at], self.v[at], self.a[at])

    @cached_property
    def _model(self) -> pin.Model:
        return robot_with(self.robot, self.phi) if self._given is None else self._given

    @cached_property
    def regressor(self) -> Array:
        """Y (T, n, 10·n_bodies) of the moved joints."""
        robot = replace(self.robot, rows=self.robot.moved)
        return Regressor(robot).evaluate(self.q, self.v, self.a)

    @cached_property
    def load(self) -> Array:
        """τ (T, n) = Y φ [N·m], without Y, which takes more room than all the rest."""
        return InverseDynamics(self.robot, self._model).torques(self.q, self.v, self.a)

    @cached_property
    def _derivatives(self) -> tuple[Array, Array, Array]:
        """Of φ with subtrees of negative mass, those of φ + s φ₁ less s times φ₁'s.

        A fit may leave such φ. They are linear in φ, and Pinocchio's recursion divides by the
        masses of subtrees.
        """
        masses = self.phi[::PARAMETERS_PER_BODY].copy()
        for body in range(self.robot.n_bodies, 0, -1):
            parent = int(self.robot.model.parents[body])
            if parent:
                masses[parent - 1] += masses[body - 1]
        lacking = -float(masses.min(initial=0.0))
        if not lacking:
            return self._derivatives_of(self._model)
        balls = np.tile(_BALL, self.robot.n_bodies)
        heavy, ball = (
            self._derivatives_of(robot_with(self.robot, phi))
            for phi in (self.phi + 2.0 * lacking * balls, balls)
        )
        by_q, by_v, mass = (x - 2.0 * lacking * y for x, y in zip(heavy, ball, strict=True))
        return by_q, by_v, mass

    def _derivatives_of(self, model: pin.Model) -> tuple[Array, Array, Array]:
        return InverseDynamics(self.robot, model).derivatives(self.q, self.v, self.a)

    @property
    def by_position(self) -> Array:
        """∂τ/∂q (T, n, n)."""
        return self._derivatives[0]

    @property
    def by_velocity(self) -> Array:
        """∂τ/∂v (T, n, n)."""
        return self._derivatives[1]

    @property
    def mass(self) -> Array:
        """∂τ/∂a, the joint-space inertia matrix (T, n, n)."""
        return self._derivatives[2]

    def forget(self) -> None:
        """Let go of what can be computed again: it is many times as large as the motion."""
        for name in ("regressor", "_derivatives", "gravity_axes"):
            self.__dict__.pop(name, None)

    def pull_back(self, weights: Array) -> tuple[Array, Array, Array]:
        """Derivatives by q, v, a, each (T, n), of Σ weights ∘ τ for weights (T, n)."""
        row = weights[:, None, :]
        by_q, by_v, mass = ((row @ part)[:, 0] for part in self._derivatives)
        return by_q, by_v, mass

    @cached_property
    def gravity_axes(self) -> Array:
        """Torque (T, n, 3) that one m/s² of gravity along world x, y, z asks for."""
        robot, model = self.robot, self._model.copy()
        data = model.createData()
        columns = np.empty((len(self.q), robot.tree.n, 3))
        configurations = robot.configurations(self.q)
        for axis in range(3):
            model.gravity.linear = np.eye(3)[axis]
            for t, q in enumerate(configurations):
                torque = pin.computeGeneralizedGravity(model, data, q)
                columns[t, :, axis] = torque[robot.tree.moved]
        return robot.gathered(columns.swapaxes(1, 2)).swapaxes(1, 2)

    def frame_jacobian(self, joint: int) -> Array:
        """Jacobian (T, 6, n) of the frame of a moved `joint`, aligned with the world."""
        robot, model = self.robot, self.robot.model
        data, frame = model.createData(), _frame_of(model, robot.model_joints[joint])
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobians = np.empty((len(self.q), 6, robot.tree.n))
        for t, q in enumerate(robot.configurations(self.q)):
            jacobian = pin.computeFrameJacobian(model, data, q, frame, aligned)
            jacobians[t] = jacobian.reshape(6, -1)[:, robot.tree.moved]  # of one column: 1-D
        return robot.gathered(jacobians)


def _frame_of(model: pin.Model, joint: int) -> int:
    return int(model.getFrameId(str(model.names[joint]), pin.FrameType.JOINT))
