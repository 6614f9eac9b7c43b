"""Friction with memory, made in other ways than the catalogue's, to be planted only.

Both come with the dry friction that they are a part of, and are called by the catalogue's name. Of
the second it is not quite true: it may as well be told as an approximation, or as unexplained, but
by no other name.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Signals
from excite_cli.effects.dahl_friction import DahlFriction
from excite_cli.effects.sign import smooth_sign
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array

_STEP = 1e-3  # s, of the controller
_SUBSTEPS = 5
_SHARES = np.array([0.4, 0.3, 0.2, 0.1])  # of the friction that each element holds
_WAYS = np.array([0.25, 0.7, 1.6, 4.0])  # distances after which each of them slips


class DahlBySpeed(DahlFriction):
    """dz/dt = v/d (1 − z sgn v), integrated over time by Euler's steps."""

    title: ClassVar = "Dahl friction, integrated over time"

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """At the joint, by its speed."""
        for j in self.joints:
            robot.remember(j, _BySpeed(float(values[0]), self.shape["distance"]))
            robot.add_to_joint(j, {"frictionloss": -float(values[0])})
        robot.tell_controller(self, values)


class _BySpeed:
    def __init__(self, friction: float, distance: float) -> None:
        self._friction, self._distance, self._z = friction, distance, 0.0

    def begin(self, q: float, v: float) -> None:
        self._z = 0.0

    def torque(self, q: float, v: float) -> float:
        rate = v * _STEP / _SUBSTEPS / self._distance
        for _ in range(_SUBSTEPS):
            self._z += rate * (1.0 - self._z * np.sign(v))
        return self._friction * self._z


class MaxwellSlip(DahlFriction):
    """Four springs in parallel, each of which slips at its own force (Iwan, Maxwell slip)."""

    title: ClassVar = "Maxwell slip of four elements"

    def columns(self, signals: Signals) -> Array:
        elements = _Elements(1.0, self.shape["distance"])
        q, v = signals.q[:, self.joints[0]], signals.v[:, self.joints[0]]
        elements.begin(float(q[0]), float(v[0]))
        bent = np.array([elements.torque(float(x), 0.0) for x in q])
        return (bent - smooth_sign(v))[:, None, None]

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """At the joint."""
        for j in self.joints:
            robot.remember(j, _Elements(float(values[0]), self.shape["distance"]))
            robot.add_to_joint(j, {"frictionloss": -float(values[0])})
        robot.tell_controller(self, values)


class _Elements:
    def __init__(self, friction: float, distance: float) -> None:
        self._forces, self._ways = friction * _SHARES, distance * _WAYS
        self._q, self._bent = 0.0, np.zeros(len(_WAYS))

    def begin(self, q: float, v: float) -> None:
        self._q, self._bent = q, np.full(len(_WAYS), np.sign(v))

    def torque(self, q: float, v: float) -> float:
        self._bent = np.clip(self._bent + (q - self._q) / self._ways, -1.0, 1.0)
        self._q = q
        return float(self._forces @ self._bent)


HISTORY: Mapping[str, type[DahlFriction]] = {
    "dahl_by_speed": DahlBySpeed,
    "maxwell_slip": MaxwellSlip,
}
