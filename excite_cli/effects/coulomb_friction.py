"""Dry friction: τ_j = f_c sgn v_j."""

from collections.abc import Sequence
from typing import ClassVar

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Tier
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array


class CoulombFriction(Effect):
    """τ_j = f_c sgn v_j, f_c ≥ 0."""

    kind: ClassVar = "coulomb_friction"
    title: ClassVar = "Coulomb friction"
    signature: ClassVar = "the residual jumps when the joint reverses and is flat in between"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("coulomb", "N·m", 0.05, 300.0, nonnegative=True, part_of_torque=True),
    )
    prior_cost: ClassVar = 0.0  # every joint has it
    tier: ClassVar = Tier.EVERY_ROBOT
    usual: ClassVar = True
    changes_between_runs: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """sgn v_j, (T, 1, 1)."""
        return smooth_sign(signals.v[:, list(self.joints), None])

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """c sgn v_j."""
        j = self.joints[0]
        return f"tau[{j}] += {real(values[0])} * s[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = weight · slope of the smoothed sign."""
        j = self.joints[0]
        slope = smooth_sign_slope(signals.v[:, j])
        return Cotangents(v=signals.only(j, weights[:, 0, 0] * slope))

    def urdf(self, values: Array) -> dict[str, float]:
        """`friction`."""
        return {"friction": float(values[0])}

    def mjcf(self, values: Array) -> dict[str, float]:
        """`frictionloss`."""
        return {"frictionloss": float(values[0])}
