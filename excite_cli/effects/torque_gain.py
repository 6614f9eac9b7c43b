"""A wrong gain of the measured torque: τ_measured = (1 + g) τ.

A wrong torque constant or gear ratio of one joint. The same gain on all joints is absorbed by the
inertial parameters, which then are all wrong by it. The gain of the joint's friction is absorbed by
its friction parameters in the same way; what shows is the gain of the rigid-body torque alone.
Of some runs it is that of all their torque.
"""

from collections.abc import Mapping
from typing import ClassVar

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array


class TorqueGain(Effect):
    """τ_j grows by g · (rigid-body torque); in runs of its own by g · (torque)."""

    kind: ClassVar = "torque_gain"
    title: ClassVar = "wrong gain of the measured torque"
    signature: ClassVar = "the residual has the shape of the torque itself"
    function_of: ClassVar = ("load",)
    parameters: ClassVar = (
        Parameter(
            "gain", "1", 0.005, 0.5, believed=(-0.5, 0.5),
            because="half of the torque is no wrong constant but another unit or gear ratio",
        ),
    )  # fmt: skip
    data_defect: ClassVar = True
    usual: ClassVar = True
    changes_between_runs: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """load_j, in runs of its own torque_j, (T, 1, 1)."""
        seen = signals.torque if self.is_change else signals.load
        return seen[:, list(self.joints), None]

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A factor on all that is recorded, friction too."""
        robot.gain[list(self.joints)] += values[0]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂load_j or ∂/∂torque_j = weight."""
        back = signals.only(self.joints[0], weights[:, 0, 0])
        return Cotangents(torque=back) if self.is_change else Cotangents(load=back)
