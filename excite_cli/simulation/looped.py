"""Effects that MuJoCo has no part for: their own formula, evaluated at every control step.

What is odd in a joint's own speed is left to MuJoCo's dry friction. With s = max(|v|, EDGE) and
τ(±s) the effect's torque at both signs of the speed,

    τ(v) = E + D sgn v,   E = (τ(s) + τ(−s))/2,   D = (τ(s) − τ(−s))/2,

D becomes the joint's friction loss for this step and only E is applied as a torque. So a jump at
standstill is solved for by the engine, sticking included, and does not chatter.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.dynamics.rigid_body import RigidBody, robot_with
from excite_cli.effects.base import Effect, Signals
from excite_cli.robot.model import Array
from excite_cli.simulation.build import Build
from excite_cli.simulation.planted import Planted

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


def _total(planted: Sequence[Planted], signals: Signals) -> Array:
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
