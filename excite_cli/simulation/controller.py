"""The robot's own controller: nominal model fed forward, and feedback on the tracking error.

    τ = τ_nominal(q_r, v_r, a_r) + c τ_effects(q_r, v_r, a_r) + M(q_r) (ω² e + 2 ω ė + ω³/8 ∫e)

with e = q_r − q. The rigid-body part of the feed-forward knows the URDF only. The rest is that of a
robot which its maker has tuned: M is the true inertia with rotors, so that the bandwidth ω is the
same for every joint, and the share c of friction and springs is compensated. Without that a light
wrist with much friction would stand still at every reversal for longer than real ones do.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np
from scipy.linalg import eigh

from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Signals
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import Build, mass_matrices, sudden_inertias
from excite_cli.simulation.mujoco_model import Plant
from excite_cli.simulation.planned_motion import Planned


class Controller(Protocol):
    """What gives the torque of a run's motors, control step by control step.

    `advice` to whoever's robot ran away; it may name the control {rate} [Hz].
    """

    advice: ClassVar[str]

    def torque(self, k: int, q: Array, v: Array) -> Array:
        """Torque (n,) from control step `k` to the next, in the state q, v (n,)."""
        ...


_MASS_EVERY = 10  # control steps
_FASTEST = 0.4  # share of the control rate that the quickest motion may be damped at


@dataclass(frozen=True)
class Reference:
    """Where the robot should be at every control step, and what the nominal model says it takes.

    `t` (N,) [s] from the start of the record, `q, v, a, feed_forward` (N, n).
    """

    t: Array
    q: Array
    v: Array
    a: Array
    feed_forward: Array


@dataclass(frozen=True)
class Gains:
    """Factors of error, speed error and integral, and the inertia (M, n, n) that they multiply.

    Each inertia is held for `every` control steps.
    """

    position: float
    speed: float
    integral: float
    mass: Array
    every: int


class TrackingControl:
    """The controller of this module's text on one run: a `Controller` with an integral.

    `clip` (n,): what the motors can give.
    """

    advice: ClassVar = "Take smaller effects, or a slower controller."

    def __init__(self, reference: Reference, gains: Gains, clip: Array) -> None:
        self._reference, self._gains = reference, gains
        self._clip = clip if np.isfinite(clip).any() else None
        self._period = float(reference.t[1] - reference.t[0])
        self._integral = np.zeros(reference.q.shape[1])

    def torque(self, k: int, q: Array, v: Array) -> Array:
        """As `Controller.torque`."""
        reference, gains = self._reference, self._gains
        error = reference.q[k] - q
        wanted = gains.position * error + gains.integral * self._integral
        wanted += gains.speed * (reference.v[k] - v)
        torque = reference.feed_forward[k] + gains.mass[k // gains.every] @ wanted
        error *= self._period
        if self._clip is not None:
            limited = np.clip(torque, -self._clip, self._clip)
            error *= limited == torque  # the integral waits while a motor is at its limit
            torque = limited
        self._integral += error
        return np.asarray(torque)


def reference_of(robot: Robot, motion: Planned, t: Array) -> Reference:
    """Reference and feed-forward at the instants `t` (N,); a base stands still."""
    q, v, a = (np.hstack([np.zeros((len(t), robot.base_joints)), x]) for x in motion.states(t))
    known = InverseDynamics(robot).torques(q, v, a)
    known[:, : robot.base_joints] = 0.0  # the ground pushes back, it knows no model
    return Reference(t, q, v, a, known)


def compensated(build: Build, reference: Reference, share: float) -> Reference:
    """The reference with `share` of the torque of the run's effects in its feed-forward."""
    if not (share and build.compensated):
        return reference
    load = reference.feed_forward
    body = RigidBody(build.robot, build.phi, reference.q, reference.v, reference.a)
    t = np.maximum(reference.t, 0.0)
    signals = Signals(
        t, reference.q, reference.v, reference.a, load, load, body, build.run, build.start,
        build.covariates(t),
    )  # fmt: skip
    extra = np.sum([p.effect.torque(signals, p.values) for p in build.compensated], axis=0)
    return replace(reference, feed_forward=load + share * extra)


def gains_of(build: Build, plant: Plant, reference: Reference, bandwidth: float) -> Gains:
    """Gains along the reference; behind a soft transmission the drive must be slower.

    A quick push moves rotors only, a slow one rotors and links. Gains are made for the geometric
    mean of these two inertias, and no motion is damped by more than a share per control step.
    """
    postures = reference.q[::_MASS_EVERY]
    mass = mass_matrices(plant, postures)
    if build.soft:
        step = float(reference.t[1] - reference.t[0])
        mass, heavier = _between(sudden_inertias(plant, postures), mass)
        bandwidth = min(bandwidth, 0.5 * _FASTEST / step / heavier)
    return Gains(bandwidth**2, 2.0 * bandwidth, bandwidth**3 / 8.0, mass, _MASS_EVERY)


def _between(light: Array, heavy: Array) -> tuple[Array, float]:
    """Geometric means (T, n, n) of inertias, and by how much they exceed the light ones at most."""
    means, heavier = [], 1.0
    for one, other in zip(light, heavy, strict=True):
        ratios, vectors = eigh(other, one)
        side = one @ vectors
        means.append(side * np.sqrt(ratios) @ side.T)
        heavier = max(heavier, float(np.sqrt(ratios[-1])))
    return np.array(means), heavier


def control_instants(start: float, end: float, rate: float) -> Array:
    """From `start` past `end` [s] at `rate`, with an instant at zero."""
    first, last = int(np.floor(start * rate)), int(np.ceil(end * rate))
    return np.arange(first, last + 1) / rate
