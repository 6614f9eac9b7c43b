"""A constant in the measured torque: τ_j = b."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array


class TorqueOffset(Effect):
    """τ_j = b."""

    kind: ClassVar = "torque_offset"
    on_base: ClassVar = True
    title: ClassVar = "offset of the measured torque"
    signature: ClassVar = "the residual is the same wherever the joint is and however it moves"
    parameters: ClassVar = (Parameter("offset", "N·m", 0.05, 50.0, part_of_torque=True),)
    data_defect: ClassVar = True
    prior_cost: ClassVar = 1.0
    usual: ClassVar = True
    changes_between_runs: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """Ones, (T, 1, 1)."""
        return np.ones((len(signals.t), 1, 1))

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """b."""
        return f"tau[{self.joints[0]}] += {real(values[0])};"

    def abscissa(self, signals: Signals) -> Abscissa:
        """Time: a constant stays where it is."""
        return Abscissa("time", "s", signals.t)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A constant in what is recorded."""
        robot.offset[list(self.joints)] += values[0]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """Nothing: a constant does not depend on the motion."""
        return Cotangents()
