"""Placements and Jacobian columns of all joints at many instants at once.

A joint i with axis (unit twist (v, w) in its own frame) stands in its parent at
    revolute:   R = P (1 + sin q [w] + (1 - cos q) [w]^2),   p = p0
    prismatic:  R = P,                                       p = p0 + P v q
with (P, p0) its fixed placement, so R is linear in (1, sin q, cos q). Placements in the world
follow level by level of the tree. A column of the world Jacobian is the joint's twist moved to the
world origin: angular R w, linear R v + p x (R w). The floating base stands at its reference.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from excite_cli.arrays import Array, Indices
from excite_cli.kernels.compiled import KERNELS
from excite_cli.robot.model import Robot
from excite_cli.trajectory.base import Trajectory


@dataclass(frozen=True)
class _Level:
    """Joints of equal depth: body numbers (joint index - 1), and those of their parents."""

    bodies: Indices
    parents: Indices  # -1: the world


class BatchKinematics:
    """Forward kinematics of `robot` for a whole array of moved-joint positions.

    Bodies are the joints 1 .. njoints-1 of `robot.model` in order; body b is joint b + 1.
    `parents` (B,), -1 for the world; `variable` (B,), the joint of `robot.tree` that turns or
    slides the body, -1 for none; `twists` (nv, 6), unit twists [linear; angular] in the frame of
    their body.
    """

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        self.n_bodies = robot.n_bodies
        self.nv = int(model.nv)
        self._robot = robot
        self._columns_body = np.zeros(self.nv, dtype=np.int64)
        self.twists = np.zeros((self.nv, 6))
        self._rotation_basis = np.zeros((self.n_bodies, 3, 9))
        self._offset = np.zeros((self.n_bodies, 3))
        self._slide = np.zeros((self.n_bodies, 3))
        self.variable = np.full(self.n_bodies, -1, dtype=np.int64)
        first_column = int(robot.moved[0])
        reference = model.createData()
        pin.forwardKinematics(model, reference, robot.reference)
        for body in range(self.n_bodies):
            joint = model.joints[body + 1]
            columns = slice(joint.idx_v, joint.idx_v + joint.nv)
            self._columns_body[columns] = body
            axis = np.array(joint.createData().S, dtype=float).reshape(6, joint.nv)
            self.twists[columns] = axis.T
            if joint.idx_v < first_column:
                self._set_fixed(body, reference.liMi[body + 1])
            else:
                self._set_moved(body, model.jointPlacements[body + 1], axis[:, 0])
                self.variable[body] = joint.idx_v - first_column
        self._axes_split = self.twists.reshape(self.nv, 2, 3).swapaxes(1, 2).copy()
        self._moving = self.variable >= 0
        self.parents = np.array([int(parent) - 1 for parent in model.parents[1:]], dtype=np.int64)
        self._levels = _levels(self.parents.tolist())

    def _set_fixed(self, body: int, placement: pin.SE3) -> None:
        self._rotation_basis[body, 0] = placement.rotation.ravel()
        self._offset[body] = placement.translation

    def _set_moved(self, body: int, placement: pin.SE3, axis: Array) -> None:
        cross = pin.skew(axis[3:])
        square = cross @ cross
        for row, term in enumerate((np.eye(3) + square, cross, -square)):
            self._rotation_basis[body, row] = (placement.rotation @ term).ravel()
        self._offset[body] = placement.translation
        self._slide[body] = placement.rotation @ axis[:3]

    def placements(self, q: Array) -> tuple[Array, Array]:
        """Rotations (T, B, 3, 3) and translations (T, B, 3) [m] of the bodies in the world.

        `q` (T, n) are the positions of the moved joints [rad or m].
        """
        q = np.asarray(q, dtype=float).reshape(-1, self._robot.n)
        q = np.ascontiguousarray(self._robot.all_positions(q))
        if KERNELS is None:
            return self._placements_by_level(q)
        rotations = np.empty((len(q), self.n_bodies, 3, 3))
        translations = np.empty((len(q), self.n_bodies, 3))
        KERNELS.call(
            "placements", self.parents, self.variable, self._rotation_basis, self._offset,
            self._slide, q, rotations, translations,
        )  # fmt: skip
        return rotations, translations

    def _placements_by_level(self, q: Array) -> tuple[Array, Array]:
        """`placements` in NumPy, joints of equal depth at once."""
        angle = np.zeros((self.n_bodies, len(q)))
        angle[self._moving] = q.T[self.variable[self._moving]]
        terms = np.stack([np.ones_like(angle), np.sin(angle), np.cos(angle)], axis=-1)
        local = np.matmul(terms, self._rotation_basis).reshape(self.n_bodies, len(q), 3, 3)
        shift = self._offset[:, None] + angle[:, :, None] * self._slide[:, None]
        rotations, translations = np.empty_like(local), np.empty_like(shift)
        for level in self._levels:
            bodies, parents = level.bodies, level.parents
            if parents[0] < 0:
                rotations[bodies], translations[bodies] = local[bodies], shift[bodies]
                continue
            parent = rotations[parents]
            rotations[bodies] = parent @ local[bodies]
            moved = (parent @ shift[bodies][..., None])[..., 0]
            translations[bodies] = translations[parents] + moved
        return rotations.swapaxes(0, 1), translations.swapaxes(0, 1)

    def axes(self, rotations: Array, translations: Array) -> Array:
        """Jacobian columns (T, nv, 6), [linear; angular] about the world origin, in world axes.

        Column j is the spatial velocity of all bodies after joint j for unit velocity of joint j:
        what `pin.computeJointJacobians` gives. Takes the answer of `placements`.
        """
        if KERNELS is not None:
            columns = np.empty((len(rotations), self.nv, 6))
            KERNELS.call(
                "axes", self._columns_body, self.twists, np.ascontiguousarray(rotations),
                np.ascontiguousarray(translations), columns,
            )  # fmt: skip
            return columns
        turn = rotations[:, self._columns_body]
        place = translations[:, self._columns_body]
        columns = np.empty((*place.shape[:2], 6))
        twist = turn @ self._axes_split  # (T, nv, 3, 2): linear and angular in world axes
        linear, angular = twist[..., 0], twist[..., 1]
        columns[..., 3:] = angular
        for k in range(3):  # written out: np.cross is several times slower
            i, j = (k + 1) % 3, (k + 2) % 3
            columns[..., k] = linear[..., k]
            columns[..., k] += place[..., i] * angular[..., j] - place[..., j] * angular[..., i]
        return columns


def _levels(parents: list[int]) -> list[_Level]:
    depth: list[int] = []
    for parent in parents:
        depth.append(0 if parent < 0 else depth[parent] + 1)
    groups = [[b for b, d in enumerate(depth) if d == level] for level in range(max(depth) + 1)]
    return [_Level(np.array(group), np.array([parents[b] for b in group])) for group in groups]


@dataclass(frozen=True)
class States:
    """q, v, a (T, n) of the moved joints; placements and motion columns are computed once.

    `jerk` (T, n), the third derivative of q, is known of motions and of what stands still.
    """

    kinematics: BatchKinematics
    q: Array
    v: Array
    a: Array
    jerk: Array | None = None

    @classmethod
    def along(
        cls, kinematics: BatchKinematics, trajectory: Trajectory, coefficients: Array, times: Array
    ) -> "States":
        """Those of a motion with coefficients (K, n) at `times` (T,) [s]."""
        return cls(kinematics, *trajectory.orders(times, coefficients))

    @classmethod
    def still(cls, kinematics: BatchKinematics, q: Array) -> "States":
        """Standing still at every one of `q` (T, n)."""
        zero = np.zeros_like(q, dtype=float)
        return cls(kinematics, q, zero, zero, zero)

    def order(self, k: int) -> Array:
        """The derivative (T, n) of q of order k: 0 to 3."""
        found = (self.q, self.v, self.a, self.jerk)[k]
        assert found is not None, "jerk is known of motions only"
        return found

    @cached_property
    def placements(self) -> tuple[Array, Array]:
        """Rotations (T, B, 3, 3) and translations (T, B, 3) of all bodies in the world."""
        return self.kinematics.placements(self.q)

    @cached_property
    def columns(self) -> Array:
        """World motion columns (T, nv, 6), [linear; angular] about the world origin."""
        return self.kinematics.axes(*self.placements)
