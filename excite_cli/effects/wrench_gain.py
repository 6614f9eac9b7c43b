"""A wrong scale of the measured wrench: w_measured = (1 + g) w, of all its components alike.

That of a force plate, or of the amplifier of a base sensor. Where nothing else is measured and no
inertia is known, all masses take it up.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals
from excite_cli.effects.c_code import real
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array


class WrenchGain(Effect):
    """The rows of the base grow by g · (wrench of the model)."""

    kind: ClassVar = "wrench_gain"
    title: ClassVar = "wrong scale of the measured wrench"
    signature: ClassVar = "the residual has the shape of the wrench itself, in all of its rows"
    scope: ClassVar = "base"
    parameters: ClassVar = (
        Parameter(
            "gain", "1", 0.005, 0.5, believed=(-0.5, 0.5),
            because="half of the wrench is no wrong scale but another unit",
        ),
    )  # fmt: skip
    data_defect: ClassVar = True
    of_whole_torque: ClassVar = True
    usual: ClassVar = True
    may_begin: ClassVar = True
    excitable: ClassVar = False
    why_not_excitable: ClassVar = "planned motions have a base that stands still"

    def columns(self, signals: Signals) -> Array:
        """The wrench, (T, 6, 1)."""
        return signals.torque[:, list(self.joints), None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """g torque_j of every row."""
        return "\n".join(f"tau[{j}] += {real(values[0])} * torque[{j}];" for j in self.joints)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A factor on the wrench that is recorded."""
        robot.gain[list(self.joints)] += values[0]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂wrench = weight."""
        torque = np.zeros_like(signals.q)
        torque[:, list(self.joints)] = weights[:, :, 0]
        return Cotangents(torque=torque)
