"""Set points that lead a motion by what drives lag behind it, so that the robot plays the motion.

A drive with τ = kp (q* − q) + kd (v* − v) makes the torque of its joint by being away from its set
point. Where it is to be at q(t), it gets, as early as set points act late,

    q*(t) = q(t′) + (τ(t′) + kd (v(t′) − v*)) / kp,    t′ = t + d + ½ step,

with τ of the URDF's inertias, v* = v(t′) where set points have speeds, and else 0. What is left are
friction and what the URDF's inertias are off. Set points keep the joints' limits of position.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from excite_cli.dynamics.regressor import InverseDynamics
from excite_cli.measurement.torque_sources.command import DriveLaw
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.note import Level, Note

_H = 1e-3  # s, of differences
_SEEN = 1e-3  # rad (m) that are told


class Moves(Protocol):
    """What has states at times, and lasts."""

    @property
    def duration(self) -> float:
        """[s]."""
        ...

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) at `times` (T,) [s]."""
        ...


@dataclass(frozen=True)
class LeadingSetPoints:
    """Set points for `motion` of `robot` with drives of the law, each held for `step` [s]."""

    motion: Moves
    robot: Robot
    law: DriveLaw
    step: float
    speeds: bool = False

    @property
    def duration(self) -> float:
        """That of the motion [s]."""
        return self.motion.duration

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q* (T, n) and its derivatives; with `speeds`, those of the motion."""
        if self.speeds:
            return (self.positions(times), *self.motion.states(self._then(times))[1:])
        before, q, after = (self.positions(times + h) for h in (-_H, 0.0, _H))
        return q, (after - before) / (2.0 * _H), (after - 2.0 * q + before) / _H**2

    def positions(self, times: Array) -> Array:
        """q* (T, n) of set points that are sent at `times` (T,)."""
        limits = self.robot.limits
        return np.clip(self._wanted(times), limits.lower, limits.upper)

    def clipped(self, times: Array, name: str) -> Note | None:
        """Which set points at `times` are held back at a joint's limit, in words; None if none."""
        wanted = self._wanted(times)
        beyond = np.abs(wanted - self.positions(times)).max(axis=0)
        j = int(np.argmax(beyond))
        if beyond[j] < _SEEN:
            return None
        joints = [self.robot.joint_names[k] for k in np.flatnonzero(beyond >= _SEEN)]
        unit = "m" if self.robot.sliding[j] else "rad"
        text = (
            f"set points of {', '.join(joints)} would leave the joints' position limits, by up to "
            f"{beyond[j]:.2g} {unit}, and stay at them: there the robot lags behind the motion. "
            "Plan with constraints.joint_limits.position_margin"
        )
        return Note(Level.HINT, text, name)

    def _then(self, times: Array) -> Array:
        return np.asarray(times, dtype=float) + self.law.delay + 0.5 * self.step

    def _wanted(self, times: Array) -> Array:
        q, v, a = self.motion.states(self._then(times))
        torque = InverseDynamics(self.robot).torques(q, v, a)
        if not self.speeds:
            torque = torque + self.law.kd * v
        return np.asarray(q + torque / self.law.kp)
