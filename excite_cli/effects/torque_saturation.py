"""Torque cut off at a level L by sensor or amplifier: −s (|torque_j| − L)₊ sgn(torque_j).

s = 1 is a clean cut. The model's torque passes L where the measured one stays there.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import (
    Abscissa,
    Cotangents,
    Effect,
    Parameter,
    Signals,
    Tier,
)
from excite_cli.effects.mechanism import real
from excite_cli.effects.parameter import whole_share
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array, Robot

_MEASURED = (0.8, 0.9, 0.95, 0.97, 0.985, 0.995)  # of a cut torque, the last ones are the level
_QUANTILES = (0.7, 0.8, 0.9, 0.95, 0.98)


class TorqueSaturation(Effect):
    """τ_j loses what |torque_j| has above `level`, times `sharpness` (1: all of it)."""

    kind: ClassVar = "torque_saturation"
    title: ClassVar = "saturation of the measured torque"
    signature: ClassVar = "the residual is zero up to a level of torque and grows from there"
    function_of: ClassVar = ("load",)
    parameters: ClassVar = (whole_share("sharpness"),)
    shapes: ClassVar = (Parameter("level", "N·m", 0.1, 1000.0),)
    finer_ratios: ClassVar = (1.05, 1.02, 1.008, 1.003, 1.001)  # a level is seen directly
    data_defect: ClassVar = True
    tier: ClassVar = Tier.LAST
    known_by: ClassVar = "level"
    settings: ClassVar[Mapping[str, float]] = {"actuator": 0.0}

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Levels at five quantiles of |torque_j|."""
        seen = [np.abs(s.torque[:, joints[0]]) for s in signals if len(s.t)]
        if not seen:
            return []
        levels = np.unique(np.quantile(np.concatenate(seen), _QUANTILES))
        return [{"level": float(level)} for level in levels if level > 0]

    @classmethod
    def tuned(
        cls,
        robot: Robot,
        joints: tuple[int, ...],
        signals: Sequence[Signals],
        residuals: Sequence[Array],
    ) -> list[dict]:
        """Levels where measured torque crowds: the highest that it reaches, give or take."""
        j = joints[0]
        measured = [
            np.abs(s.torque[:, j] + np.asarray(r)[:, j])
            for s, r in zip(signals, residuals, strict=True)
            if len(s.t)
        ]
        if not measured:
            return []
        levels = np.unique(np.quantile(np.concatenate(measured), _MEASURED))
        return [{"level": float(level)} for level in levels if level > 0]

    def cuts_at(self) -> tuple[tuple[int, float], ...]:
        """At the level."""
        return ((self.joints[0], self.shape["level"]),)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """The reading saturates; with `actuator` 1 the motor itself does, and tracking suffers."""
        joints = list(self.joints)
        if numbers["actuator"] > 0.0:
            robot.clip[joints] = np.minimum(robot.clip[joints], numbers["level"])
        else:
            robot.reading[joints] = [numbers["sharpness"], numbers["level"]]

    def columns(self, signals: Signals) -> Array:
        """−(|torque_j| − L)₊ sgn(torque_j), (T, 1, 1)."""
        torque, level = signals.torque[:, list(self.joints), None], self.shape["level"]
        return np.clip(torque, -level, level) - torque

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """s (torque_j, cut off, less torque_j)."""
        j, level, share = self.joints[0], real(self.shape["level"]), real(values[0])
        over = f"fmin(fmax(torque[{j}], -{level}), {level}) - torque[{j}]"
        return f"tau[{j}] += {share} * ({over});"

    def abscissa(self, signals: Signals) -> Abscissa:
        """The model's torque, before it is cut off."""
        return Abscissa("torque of the model", "N·m", signals.torque[:, self.joints[0]])

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂torque_j = −weight above the level, else zero."""
        j = self.joints[0]
        above = np.abs(signals.torque[:, j]) > self.shape["level"]
        return Cotangents(torque=signals.only(j, -weights[:, 0, 0] * above))
