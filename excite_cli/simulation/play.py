"""Plays one motion: a control step is a few array operations and one call into MuJoCo."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody, robot_with
from excite_cli.effects.base import Effect, Signals
from excite_cli.errors import RobotError
from excite_cli.robot.model import Array
from excite_cli.simulation.build import Build
from excite_cli.simulation.controller import Controller, Reference
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.mujoco_model import Plant, load_mujoco

# Effects that MuJoCo has no part for: their own formula, evaluated at every control step.
#
# What is odd in a joint's own speed is left to MuJoCo's dry friction. With s = max(|v|, EDGE) and
# τ(±s) the effect's torque at both signs of the speed,
#
#     τ(v) = E + D sgn v,   E = (τ(s) + τ(−s))/2,   D = (τ(s) − τ(−s))/2,
#
# D becomes the joint's friction loss for this step and only E is applied as a torque. So a jump at
# standstill is solved for by the engine, sticking included, and does not chatter.

EDGE = 5e-3  # rad/s; the smoothed sign is ±1 to 1e-4 there


class LoopedEffects:
    """The torque of the looped effects of a run's robot, instant by instant."""

    def __init__(self, build: Build) -> None:
        self._build, robot, planted = build, build.robot, build.looped
        self._model = robot_with(robot, build.phi)
        self._local = [p for p in planted if p.effect.scope == "joint"]
        self._wide = [p for p in planted if p.effect.scope != "joint"]
        self._zero = np.zeros(robot.n)
        self._states = {rows: np.zeros((4, rows, robot.n)) for rows in (1, 2)}
        self._times = {rows: np.zeros(rows) for rows in (1, 2)}

    def at(self, t: float, q: Array, v: Array, a: Array, load: Array) -> tuple[Array, Array]:
        """E and D (n,), the torque to apply and the dry friction; all arguments (n,)."""
        smooth, dry = self._zero, self._zero
        if self._local:
            speed = np.maximum(np.abs(v), EDGE)
            signals = self._signals(2, t, q, speed, a, load)
            np.negative(speed, out=signals.v[1])
            forward, back = _total(self._local, signals)
            smooth, dry = 0.5 * (forward + back), 0.5 * (forward - back)
        if self._wide:
            smooth = smooth + _total(self._wide, self._signals(1, t, q, v, a, load))[0]
        return smooth, dry

    def _signals(self, rows: int, t: float, q: Array, v: Array, a: Array, load: Array) -> Signals:
        """Signals of `rows` equal instants, in memory that is used again at the next step."""
        states, times = self._states[rows], self._times[rows]
        states[0], states[1], states[2], states[3] = q, v, a, load
        times[:] = max(t, 0.0)
        q, v, a, load = states
        build = self._build
        body = RigidBody(build.robot, build.phi, q, v, a, model=self._model)
        covariates = build.covariates(times)
        return Signals(times, q, v, a, load, load, body, build.run, build.start, covariates)


def _total(planted: Sequence[PlantedEffect], signals: Signals) -> Array:
    """Sum of the effects' torques (T, n); the plain product is taken here, where time counts."""
    total = np.zeros_like(signals.q)
    for each in planted:
        effect = each.effect
        if type(effect).torque is not Effect.torque:
            total += effect.torque(signals, each.values)
            continue
        torque = effect.columns(signals) @ each.values
        for i, row in enumerate(effect.rows(total.shape[1])):
            total[:, row] += torque[:, i]
    return total


_RUNAWAY = 1e3  # rad
_PUSHING_WIDTH = 1e-2  # rad/s


@dataclass(frozen=True)
class MotorRecord:
    """What happened at the control instants `t` (N,): positions and torques of the motors (N, n).

    A torque stands from its instant to the next. `step` is the physics step [s].
    """

    t: Array
    q: Array
    v: Array
    tau: Array
    step: float


def play(build: Build, plant: Plant, reference: Reference, controller: Controller) -> MotorRecord:
    """Let the controller lead the robot along the reference, from rest relative to it.

    Raises
    ------
    RobotError
        The robot ran away.
    """
    mujoco = load_mujoco()
    model = plant.model
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data = plant.new_data()
    rows, n = reference.q.shape
    # Views into MuJoCo's memory; a slice, where it will do, costs less than indices.
    motor = plant.motor if build.soft or plant.coupled else slice(None)
    qpos, qvel, applied = data.qpos, data.qvel, data.qfrc_applied
    qpos[:] = plant.coordinates(reference.q[0])
    qvel[:] = plant.spread[:, :n] @ reference.v[0]
    _engage(build, plant, data, reference.feed_forward[0])
    mujoco.mj_forward(model, data)
    effects = _Effects(build, plant, data) if build.looped else None
    for j, hysteresis in build.hystereses:
        hysteresis.begin(float(reference.q[0, j]), float(reference.v[0, j]))
    pushing = _Pushing(build, plant, data) if build.pushes else None
    period = float(reference.t[1] - reference.t[0])
    substeps = round(period / model.opt.timestep)
    q, v, tau = np.empty((3, rows, n))
    for k in range(rows):
        qk, vk = q[k], v[k]
        qk[:], vk[:] = qpos[motor], qvel[motor]
        torque = controller.torque(k, qk, vk)
        tau[k] = torque
        if effects is not None:
            torque = torque - effects.at(reference.t[k] + 0.5 * period, qk, vk, 0.5 * period)
        for j, hysteresis in build.hystereses:
            # Half a step ahead, since the torque stands for the whole step.
            torque[j] -= hysteresis.torque(float(qk[j] + 0.5 * period * vk[j]), float(vk[j]))
        if pushing is not None:
            pushing.at(reference.t[k])
        applied[motor] = torque
        mujoco.mj_step(model, data, substeps)
    _check(build, reference, q, controller.advice)
    return MotorRecord(reference.t, q, v, tau, float(model.opt.timestep))


def _engage(build: Build, plant: Plant, data: Any, load: Array) -> None:
    """Put soft transmissions where they stand under `load` (n,), lest they swing for long."""
    for j, transmission in build.soft.items():
        twist = -load[j] / transmission.stiffness if transmission.stiffness > 0.0 else 0.0
        data.qpos[plant.gear[j]] = twist - np.sign(load[j]) * transmission.play / 2


class _Effects:
    """Applies looped effects: their dry part as the joints' friction loss, the rest as torque."""

    def __init__(self, build: Build, plant: Plant, data: Any) -> None:
        self._looped = LoopedEffects(build)
        self._motor = plant.motor if build.soft or plant.coupled else slice(None)
        self._load = _Load(plant, data, self._motor)
        self._acceleration = data.qacc
        self._friction = plant.model.dof_frictionloss
        self._base = self._friction[self._motor].copy()

    def at(self, t: float, q: Array, v: Array, ahead: float) -> Array:
        """Torque (n,) to take off the motors', for the state `ahead` [s] of q and v."""
        a = self._acceleration[self._motor]
        smooth, dry = self._looped.at(t, q + ahead * v, v + ahead * a, a, self._load.now())
        dry = self._base + dry
        self._friction[self._motor] = np.maximum(dry, 0.0)
        if dry.min() < 0.0:  # friction below zero pushes
            smooth = smooth + np.minimum(dry, 0.0) * np.tanh(v / _PUSHING_WIDTH)
        return smooth


class _Load:
    """Rigid-body torque that the joints carry in the state MuJoCo has just left."""

    def __init__(self, plant: Plant, data: Any, motor: Any) -> None:
        self._multiply = load_mujoco().mj_mulM
        self._model, self._data, self._motor = plant.model, data, motor
        self._armature = plant.model.dof_armature[motor].copy()
        self._gathered = plant.spread[:, : len(plant.motor)].T if plant.coupled else None
        self._product = np.zeros(plant.model.nv)
        self._acceleration, self._bias = data.qacc, data.qfrc_bias

    def now(self) -> Array:
        """(n,) [N·m]."""
        self._multiply(self._model, self._data, self._product, self._acceleration)
        carried: Array = self._product + self._bias
        motor, gathered = self._motor, self._gathered
        carried = carried[motor] if gathered is None else gathered @ carried
        return carried - self._armature * self._acceleration[motor]


class _Pushing:
    """Applies forces to the frames of joints while they last."""

    def __init__(self, build: Build, plant: Plant, data: Any) -> None:
        bodies = plant.bodies[np.array(build.robot.model_joints) - 1]
        self._pushes = [(int(bodies[push.joint]), push) for push in build.pushes]
        self._data = data

    def at(self, t: float) -> None:
        """Set the forces of the instant `t`; MuJoCo wants them at the centre of mass."""
        for body, _ in self._pushes:
            self._data.xfrc_applied[body] = 0.0
        for body, push in self._pushes:
            if push.start <= t <= push.end:
                lever = self._data.xpos[body] - self._data.xipos[body]
                self._data.xfrc_applied[body] += [*push.force, *np.cross(lever, push.force)]


def _check(build: Build, reference: Reference, q: Array, advice: str) -> None:
    away = ~np.isfinite(q) | (np.abs(q - reference.q) > _RUNAWAY)
    if not away.any():
        return
    k = int(np.argmax(away.any(axis=1)))
    joint = build.robot.joint_names[int(np.argmax(away[k]))]
    rate = 1.0 / float(reference.t[1] - reference.t[0])
    raise RobotError(
        f"run '{build.run.key}': the simulated robot ran away at {reference.t[k]:.3f} s, first "
        f"joint '{joint}'. {advice.format(rate=rate)}"
    )
