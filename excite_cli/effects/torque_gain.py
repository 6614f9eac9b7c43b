"""A wrong gain of the measured torque: τ_measured = (1 + g) τ.

A wrong torque constant or gear ratio of one joint. The same gain on all joints is absorbed by the
inertial parameters, which then are all wrong by it. It is that of the joint's whole torque:
friction beside it is told as it is in the robot, not as the sensor shows it.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array


class TorqueGain(Effect):
    """τ_j grows by g · (torque of the model)."""

    kind: ClassVar = "torque_gain"
    title: ClassVar = "wrong gain of the measured torque"
    signature: ClassVar = "the residual has the shape of the torque itself"
    function_of: ClassVar = ("load",)
    parameters: ClassVar = (
        Parameter(
            "gain", "1", 0.005, 0.5, believed=(-0.5, 0.5),
            because="a gain that is wrong by half is a wrong unit or gear ratio",
        ),
    )  # fmt: skip
    data_defect: ClassVar = True
    on_base: ClassVar = True
    of_whole_torque: ClassVar = True
    identified_by: ClassVar = "one run carries a known payload (identification.known_payload)"
    usual: ClassVar = True
    changes_between_runs: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """torque_j, (T, len(joints), 1)."""
        return signals.torque[:, list(self.joints), None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """g torque_j."""
        return "\n".join(f"tau[{j}] += {real(values[0])} * torque[{j}];" for j in self.joints)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A factor on all that is recorded, friction too."""
        robot.gain[list(self.joints)] += values[0]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂torque_j = weight."""
        torque = np.zeros_like(signals.q)
        torque[:, list(self.joints)] = weights[:, :, 0]
        return Cotangents(torque=torque)
