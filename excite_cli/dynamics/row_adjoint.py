"""Derivatives of single rows of inverse dynamics, each with inertias of its own.

A bound that holds for every inertia of a set binds, at each instant and for each joint, at another
inertia. So K values are wanted with their derivatives,

    L_k = s_k · Σ_{b ∈ B} f_b(φ_k),        f_b = I_b A_b + V_b ×* (I_b V_b),

with f_b the force that body b needs, in world axes about the world origin. With s = S_j and B the
bodies that joint j carries, L is the torque of joint j; with s fixed and B all bodies it is a
component of the wrench that the ground must give. I_b(φ_k) is the spatial inertia of any ten
numbers. By the formulas of `spatial_adjoint`, for one row, with

    g_b = I_b s,      u_b = I_b (s × V_b) − s ×* I_b V_b + V_b ×* I_b s,

sums over the bodies of B that joint l carries, and j < l meaning that l is further out than s:

    ∂L/∂q_l = S̈_l·Σ g_b + Ṡ_l·Σ u_b − [j < l] S_l·(s ×* Σ f_b)
    ∂L/∂v_l = 2 Ṡ_l·Σ g_b + S_l·Σ u_b,        ∂L/∂a_l = S_l·Σ g_b.
"""

from dataclasses import dataclass

import numpy as np

from excite_cli.arrays import Indices
from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint, motion_cross
from excite_cli.robot.link_frame import carried_bodies
from excite_cli.robot.model import Array, Robot

Derivatives = tuple[Array, Array, Array]
Vectors = tuple[Array, Array]  # linear and angular part, each with its three components first


@dataclass(frozen=True)
class _Motion:
    """World motion at the instants requested, components first.

    Of the bodies (…, T, B): orientation (3, 3), place (3), velocity and acceleration (6), of all
    joints that move (6, T, m): columns with their first and second rates.
    """

    turn: Array
    place: Array
    velocity: Array
    acceleration: Array
    column: Array
    rate: Array
    second_rate: Array


class RowAdjoint:
    """Derivatives of K rows with respect to q, v, a of their instants, each (K, n)."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._adjoint = SpatialAdjoint(robot)
        self._carries = carried_bodies(robot).T[:, 1:]
        self._own = np.arange(robot.first_joint - 1, robot.n_bodies)
        self._shares = np.eye(robot.n) if robot.coupling is None else robot.coupling.matrix

    def torques(
        self, q: Array, v: Array, a: Array, times: Indices, joints: Indices, phi: Array
    ) -> Derivatives:
        """Derivatives of the torque of `joints` (K,) at `times` (K,) with inertias of their own.

        Parameters
        ----------
        q, v, a: (T, n) of the moved joints
        phi: (K, 10·n_bodies)
        """
        motion, times = self._motion(q, v, a, times)
        inertias = phi.reshape(len(times), -1, 10)
        found = tuple(np.zeros((len(times), self._robot.n)) for _ in range(3))
        for joint in np.unique(joints):
            rows = np.flatnonzero(joints == joint)
            for member in np.flatnonzero(self._shares[:, joint]):
                carried = np.flatnonzero(self._carries[member])
                further = self._carries[member, self._own].copy()
                further[member] = 0.0
                parts = self._rows(
                    motion,
                    times[rows],
                    motion.column[:, times[rows], member],
                    carried,
                    inertias[np.ix_(rows, carried)],
                    further,
                )
                for whole, part in zip(found, parts, strict=True):
                    whole[rows] += self._shares[member, joint] * part
        return found[0], found[1], found[2]

    def wrenches(
        self, q: Array, v: Array, a: Array, times: Indices, functionals: Array, phi: Array
    ) -> Derivatives:
        """Derivatives of s·W, W the wrench about the world origin that all bodies need.

        Parameters
        ----------
        functionals: s (K, 6) on [force; moment]
        phi: (K, 10·n_bodies); what stands still needs the same wrench whatever the motion
        """
        motion, times = self._motion(q, v, a, times)
        every = np.arange(self._robot.n_bodies)
        inertias = phi.reshape(len(times), -1, 10)
        return self._rows(motion, times, functionals.T, every, inertias, np.ones(len(self._own)))

    def _motion(self, q: Array, v: Array, a: Array, times: Indices) -> tuple[_Motion, Indices]:
        """The motion at the instants that occur, and where each row is among them."""
        instants, inverse = np.unique(times, return_inverse=True)
        bodies = self._adjoint.body_motion(q[instants], v[instants], a[instants])
        moved = self._robot.tree.moved
        column, rate = bodies.columns[:, moved], bodies.column_rates[:, moved]
        second_rate = motion_cross(bodies.acceleration[:, self._own], column)
        second_rate += motion_cross(bodies.velocity[:, self._own], rate)
        found = _Motion(
            turn=_components_first(bodies.rotations, 2),
            place=_components_first(bodies.translations),
            velocity=_components_first(bodies.velocity),
            acceleration=_components_first(bodies.acceleration),
            column=_components_first(column),
            rate=_components_first(rate),
            second_rate=_components_first(second_rate),
        )
        return found, inverse

    def _rows(
        self,
        motion: _Motion,
        times: Indices,
        s: Array,
        bodies: Indices,
        inertias: Array,
        further: Array,
    ) -> Derivatives:
        """Derivatives of s·Σ f over `bodies` (b,), with s (6, K) and `inertias` (K, b, 10)."""
        t = times[:, None]
        place = motion.place[:, t, bodies]
        turn = motion.turn[:, :, t, bodies]
        inertia = _Inertia.in_world(turn, place, _components_first(inertias))
        velocity = _halves(motion.velocity[:, t, bodies])
        acceleration = _halves(motion.acceleration[:, t, bodies])
        along = _halves(np.broadcast_to(s[:, :, None], (6, *place.shape[1:])))
        by_acceleration = inertia.times(along)
        momentum = inertia.times(velocity)
        by_velocity = _minus(
            inertia.times(_of_motions(along, velocity)), _of_force(along, momentum)
        )
        by_velocity = _plus(by_velocity, _of_force(velocity, by_acceleration))
        force = _plus(inertia.times(acceleration), _of_force(velocity, momentum))
        shared = self._carries[:, bodies].T
        summed = [np.concatenate(part) @ shared for part in (by_acceleration, by_velocity, force)]
        carried = np.concatenate(_of_force(_halves(s[:, :, None]), _halves(summed[2])))
        column, rate = motion.column[:, times], motion.rate[:, times]
        gq = motion.second_rate[:, times] * summed[0] + rate * summed[1]
        gq -= column * (carried * further)
        gv = 2 * rate * summed[0] + column * summed[1]
        parts = (gq, gv, column * summed[0])
        by_q, by_v, by_a = (self._robot.gathered(part.sum(axis=0)) for part in parts)
        return by_q, by_v, by_a


@dataclass(frozen=True)
class _Inertia:
    """Bodies in world axes: place p (3, …), mass (…), first (3, …) and second moments about p.

    `second` in the order Ixx, Ixy, Iyy, Ixz, Iyz, Izz.
    """

    place: Array
    mass: Array
    first: Array
    second: tuple[Array, ...]

    @classmethod
    def in_world(cls, turn: Array, place: Array, ten: Array) -> "_Inertia":
        """From orientations (3, 3, …) and ten parameters (10, …) in the bodies' axes."""
        first = (turn * ten[1:4]).sum(axis=1)
        xx, xy, yy, xz, yz, zz = ten[4:]
        half = [
            (r[0] * xx + r[1] * xy + r[2] * xz, r[0] * xy + r[1] * yy + r[2] * yz,
             r[0] * xz + r[1] * yz + r[2] * zz)
            for r in turn
        ]  # fmt: skip
        second = tuple(
            half[i][0] * turn[j, 0] + half[i][1] * turn[j, 1] + half[i][2] * turn[j, 2]
            for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
        )
        return cls(place, ten[0], first, second)

    def times(self, motion: Vectors) -> Vectors:
        """Momentum I x about the world origin of motions x, seen from there as well."""
        linear, spin = motion
        linear = linear + _cross(spin, self.place)
        xx, xy, yy, xz, yz, zz = self.second
        force = self.mass * linear + _cross(spin, self.first)
        moment = _cross(self.first, linear) + _cross(self.place, force)
        moment[0] += xx * spin[0] + xy * spin[1] + xz * spin[2]
        moment[1] += xy * spin[0] + yy * spin[1] + yz * spin[2]
        moment[2] += xz * spin[0] + yz * spin[1] + zz * spin[2]
        return force, moment


def _components_first(x: Array, components: int = 1) -> Array:
    """(…, c) as (c, …), or (…, c, d) as (c, d, …), in memory as well."""
    ends = range(-components, 0)
    return np.ascontiguousarray(np.moveaxis(x, tuple(ends), tuple(range(components))))


def _halves(x: Array) -> Vectors:
    return x[:3], x[3:]


def _plus(a: Vectors, b: Vectors) -> Vectors:
    return a[0] + b[0], a[1] + b[1]


def _minus(a: Vectors, b: Vectors) -> Vectors:
    return a[0] - b[0], a[1] - b[1]


def _cross(a: Array, b: Array) -> Array:
    """a × b over the first axis."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=found[k])
        found[k] -= a[j] * b[i]
    return found


def _of_motions(a: Vectors, b: Vectors) -> Vectors:
    """Spatial a × b."""
    return _cross(a[1], b[0]) + _cross(a[0], b[1]), _cross(a[1], b[1])


def _of_force(a: Vectors, f: Vectors) -> Vectors:
    """Spatial a ×* f."""
    return _cross(a[1], f[0]), _cross(a[0], f[0]) + _cross(a[1], f[1])
