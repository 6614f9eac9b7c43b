"""Where all bodies of a robot can be, and how they can move, over whole intervals of time.

The recursion of rigid-body kinematics in world axes, on enclosures (`proof.taylor`): with z the
axis of joint i in the world, λ its parent, r the way from the parent's origin,

    R = R_λ P (1 + sin q [w] + (1 − cos q) [w]²)                      revolute
    p = p_λ + R_λ p₀ (+ z q)                                          (prismatic)
    ω = ω_λ + z v,           α = α_λ + z a + ω_λ × z v
    p̈ = p̈_λ + α_λ × r + ω_λ × (ω_λ × r)  (+ z a + 2 ω_λ × z v)

Written apart from `forward_kinematics`, so that a certificate and the optimiser do not share a
mistake. The base stands still; gravity is taken as an upward acceleration of it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import factorial

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from excite_cli.proof.taylor import (
    Array,
    Taylor,
    applied,
    cross,
    matmul,
    sine_and_cosine,
    transposed,
)
from excite_cli.robot.model import Robot
from excite_cli.trajectory.base import Trajectory

# Positions and their first three derivatives of a trajectory over whole intervals of time.
#
# About the middle t_c of an interval of half width h, with t = t_c + s h,
#
#     q(t) = Σ_{k ≤ D} q⁽ᵏ⁾(t_c) (s h)ᵏ / k! + e,     |e| ≤ max|q⁽ᴰ⁺¹⁾| h^(D+1) / (D+1)!
#
# For a polynomial piece of degree D (B-splines between knots) e is zero; for a Fourier series the
# last derivative has a bound for all times, the sum of its amplitudes. Terms beyond s² go into
# the radius of the enclosure. The same with the derivatives moved on by one, two and three gives
# v, a and jerk. Intervals end at the breaks of a trajectory, so that jerk may jump there.


@dataclass(frozen=True)
class Intervals:
    """Intervals of time: middles (T,) and half widths (T,) [s], each within one smooth piece."""

    middles: Array
    halves: Array

    def __len__(self) -> int:
        return len(self.middles)

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Intervals":
        """Some of them."""
        return Intervals(self.middles[chosen], self.halves[chosen])

    def halved(self) -> "Intervals":
        """Each cut in two."""
        quarter = self.halves / 2
        middles = np.concatenate([self.middles - quarter, self.middles + quarter])
        return Intervals(middles, np.tile(quarter, 2))


@dataclass(frozen=True)
class EnclosedStates:
    """q, v, a and jerk of the moved joints over intervals, each enclosing (T, n)."""

    q: Taylor
    v: Taylor
    a: Taylor
    jerk: Taylor

    def order(self, k: int) -> Taylor:
        """The derivative of q of order k: 0 to 3."""
        return (self.q, self.v, self.a, self.jerk)[k]


def intervals_of(trajectory: Trajectory, width: float) -> Intervals:
    """Intervals not wider than `width` [s] that cover the whole trajectory."""
    parts = []
    breaks = trajectory.breaks
    for begin, end in pairwise(breaks.tolist()):
        count = max(1, int(np.ceil((end - begin) / width - 1e-9)))
        parts.append(np.linspace(begin, end, count + 1))
    begins = np.concatenate([part[:-1] for part in parts])
    ends = np.concatenate([part[1:] for part in parts])
    return Intervals((begins + ends) / 2, (ends - begins) / 2)


def enclosed_states(
    trajectory: Trajectory, coefficients: Array, intervals: Intervals
) -> EnclosedStates:
    """What q, v, a and jerk can be in each of the intervals."""
    derivatives = trajectory.derivatives(intervals.middles, coefficients)
    beyond, h = trajectory.beyond(coefficients), intervals.halves[:, None]
    found = [_enclosed(derivatives[shift:], beyond, h) for shift in range(4)]
    return EnclosedStates(*found)


def _enclosed(derivatives: Array, beyond: Array, h: Array) -> Taylor:
    terms = np.zeros((3, *derivatives.shape[1:]))
    radius = np.broadcast_to(
        beyond * h ** len(derivatives) / factorial(len(derivatives)), terms.shape[1:]
    )
    for order, derivative in enumerate(derivatives):
        term = derivative * h**order / factorial(order)
        if order < 3:
            terms[order] = term
        else:
            radius = radius + np.abs(term)
    return Taylor(terms, radius)


@dataclass(frozen=True)
class _Joint:
    """What is fixed of a joint: its parent, placement (R, p) and axis, and which q moves it."""

    parent: int
    turn: Array
    shift: Array
    axis: Array
    sliding: bool
    variable: int


@dataclass(frozen=True)
class Rates:
    """Angular velocity, angular acceleration, and acceleration of the origin less gravity."""

    spin: Taylor
    spin_rate: Taylor
    acceleration: Taylor


class EnclosedMotion:
    """Bodies of `robot` over T intervals; index b is joint b of `robot.model`, 0 the world.

    `states` are those of the moved joints, `every` those of all that move: joints that follow
    others do so by a linear map, which enclosures pass without loss.
    """

    def __init__(self, robot: Robot, states: EnclosedStates) -> None:
        self.robot, self.states = robot, states
        self.every = _of_all(robot, states)
        self.count = states.q.shape[0]
        self._joints = _joints_of(robot)

    @cached_property
    def at_rest(self) -> "EnclosedMotion":
        """The robot standing still wherever it may be in an interval; it shares where that is."""
        still = Taylor.constant(np.zeros(self.states.q.shape))
        states = replace(self.states, v=still, a=still, jerk=still)
        found = EnclosedMotion(self.robot, states)
        found.__dict__.update(placements=self.placements, axes=self.axes)
        return found

    @cached_property
    def placements(self) -> tuple[tuple[Taylor, Taylor], ...]:
        """Rotation (T, 3, 3) and origin (T, 3) [m] of every body in the world."""
        sine, cosine = sine_and_cosine(self.every.q)
        world = (
            Taylor.constant(np.tile(np.eye(3), (self.count, 1, 1))),
            Taylor.constant(np.zeros((self.count, 3))),
        )
        found = [world]
        for joint in self._joints:
            turn, origin = found[joint.parent]
            origin = origin + _moved(turn, joint.shift)
            placed = _moved(turn, joint.turn)
            if joint.variable < 0:
                found.append((placed, origin))
                continue
            if joint.sliding:
                way = self.every.q[:, joint.variable, None]
                axis = _moved(placed, joint.axis)
                found.append((placed, origin + way.times(axis)))
                continue
            found.append(
                (
                    matmul(
                        placed,
                        _rotation(joint.axis, sine[:, joint.variable], cosine[:, joint.variable]),
                    ),
                    origin,
                )
            )
        return tuple(found)

    @cached_property
    def axes(self) -> tuple[Taylor | None, ...]:
        """World axis (T, 3) of every joint; None for the world and what stands still."""
        found: list[Taylor | None] = [None]
        for index, joint in enumerate(self._joints, start=1):
            turn = self.placements[index][0]
            found.append(_moved(turn, joint.axis) if joint.variable >= 0 else None)
        return tuple(found)

    @cached_property
    def rates(self) -> tuple[Rates, ...]:
        """Velocities and accelerations of every body."""
        still = Taylor.constant(np.zeros((self.count, 3)))
        lifted = still - np.asarray(self.robot.model.gravity.linear)
        found = [Rates(still, still, lifted)]
        for index, joint in enumerate(self._joints, start=1):
            before = found[joint.parent]
            way = self.placements[index][1] - self.placements[joint.parent][1]
            acceleration = before.acceleration + _carried(before, way)
            axis = self.axes[index]
            if axis is None:
                found.append(Rates(before.spin, before.spin_rate, acceleration))
                continue
            speed = self.every.v[:, joint.variable, None].times(axis)
            change = self.every.a[:, joint.variable, None].times(axis)
            turned = cross(before.spin, speed)
            if joint.sliding:
                acceleration = acceleration + change + turned.scaled(2.0)
                found.append(Rates(before.spin, before.spin_rate, acceleration))
                continue
            found.append(
                Rates(before.spin + speed, before.spin_rate + change + turned, acceleration)
            )
        return tuple(found)

    def points(self, body: int, local: Array) -> Taylor:
        """World positions (T, K, 3) of points (K, 3) that are fixed in a body."""
        turn, origin = self.placements[body]
        spread = Taylor(
            np.einsum("otij,kj->otki", turn.terms, local),
            np.einsum("tij,kj->tki", turn.radius, np.abs(local)),
        )
        return spread + origin[:, None]

    def column(self, joint: int) -> tuple[Taylor, Taylor, bool]:
        """Axis (T, 3), origin (T, 3) of a moved joint of the model, and whether it slides."""
        axis = self.axes[joint]
        assert axis is not None, "a joint that stands still has no axis"
        return axis, self.placements[joint][1], self._joints[joint - 1].sliding


def _of_all(robot: Robot, states: EnclosedStates) -> EnclosedStates:
    if robot.coupling is None:
        return states
    q, *rates = (states.order(k).through(robot.coupling.matrix) for k in range(4))
    return EnclosedStates(q + robot.coupling.offset, *rates)


def _joints_of(robot: Robot) -> tuple[_Joint, ...]:
    model = robot.model
    first = int(robot.moved[0])
    reference = model.createData()
    pin.forwardKinematics(model, reference, robot.reference)
    found = []
    for index in range(1, model.njoints):
        joint = model.joints[index]
        moved = joint.idx_v >= first
        place = model.jointPlacements[index] if moved else reference.liMi[index]
        twist = np.array(joint.createData().S, dtype=float).reshape(6, joint.nv)[:, 0]
        sliding = bool(np.any(twist[:3]))
        found.append(
            _Joint(
                parent=int(model.parents[index]),
                turn=np.array(place.rotation),
                shift=np.array(place.translation),
                axis=twist[:3] if sliding else twist[3:],
                sliding=sliding,
                variable=int(joint.idx_v) - first if moved else -1,
            )
        )
    return tuple(found)


def _rotation(axis: Array, sine: Taylor, cosine: Taylor) -> Taylor:
    """1 + sin q [w] + (1 − cos q) [w]² (T, 3, 3)."""
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    square = skew @ skew
    one = sine[:, None, None].scaled(skew) - cosine[:, None, None].scaled(square)
    return one + (np.eye(3) + square)


def _moved(turn: Taylor, local: Array) -> Taylor:
    """A vector (3,) or axes (3, 3) fixed in a body, in world axes (T, 3) or (T, 3, 3)."""
    return Taylor(turn.terms @ local, turn.radius @ np.abs(local))


def _carried(rates: Rates, way: Taylor) -> Taylor:
    """Acceleration that turning gives to a point `way` from the origin."""
    return cross(rates.spin_rate, way) + cross(rates.spin, cross(rates.spin, way))


def turned_back(turn: Taylor, vectors: Taylor) -> Taylor:
    """Rᵀ x: world vectors (T, 3) or (T, K, 3) in the axes of a body."""
    back = transposed(turn)
    if len(vectors.shape) == 2:
        return applied(back, vectors)
    return transposed(matmul(back, transposed(vectors)))
