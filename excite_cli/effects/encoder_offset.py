"""Encoder offset (a wrong zero): q_true = q_measured + offset.

To first order the torque of all joints changes by offset · ∂τ/∂q_j at the measured position.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals
from excite_cli.effects.directional import slope_of_gradient
from excite_cli.effects.mechanism import all_joints, real
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.model import Array

_MISSED = 0.3  # per rad, one standard deviation; measured on simulated arms


class EncoderOffset(Effect):
    """q_true = q_measured + offset on one joint; shows in all rows."""

    kind: ClassVar = "encoder_offset"
    title: ClassVar = "offset of an encoder"
    signature: ClassVar = "residuals on many joints as if one of them stood elsewhere"
    in_all_rows: ClassVar = True
    parameters: ClassVar = (
        Parameter(
            "offset", "rad", 1e-3, 0.2, believed=(-0.2, 0.2),
            because="an offset of more than 0.2 rad (m) is visible",
        ),
    )  # fmt: skip
    usual: ClassVar = True
    can_appear_later: ClassVar = True

    def model_error(self, values: Array) -> Array:
        """What the second order makes of it, as a share the offset itself [rad] or less."""
        return _MISSED * values**2

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """What is recorded is the true angle less the offset."""
        robot.position_offset[list(self.joints)] -= values[0]

    def columns(self, signals: Signals) -> Array:
        """∂τ/∂q_j, (T, n, 1)."""
        return signals.body.by_position[:, :, list(self.joints)]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """x ∂τ/∂q_j."""
        return all_joints(f"slopes(q, v, a, {self.joints[0]}, {real(values[0])}, 0, 0, out)")

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """Second derivatives of the torque along q_j (`slope_of_gradient`)."""
        along = signals.only(self.joints[0], np.ones(len(signals.t)))
        gq, gv, ga = slope_of_gradient(signals.body, weights[:, :, 0], along)
        return Cotangents(q=gq, v=gv, a=ga)
