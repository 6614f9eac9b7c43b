"""Friction proportional to speed: τ_j = f_v v_j."""

from collections.abc import Sequence
from typing import ClassVar

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Tier
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array


class ViscousFriction(Effect):
    """τ_j = f_v v_j, f_v ≥ 0."""

    kind: ClassVar = "viscous_friction"
    title: ClassVar = "viscous friction"
    signature: ClassVar = "the residual is a straight line through zero over the joint's speed"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (Parameter("viscous", "N·m·s/rad", 0.1, 100.0, nonnegative=True),)
    prior_cost: ClassVar = 0.0  # every joint has it
    tier: ClassVar = Tier.EVERY_ROBOT
    usual: ClassVar = True
    changes_between_runs: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """v_j, (T, 1, 1)."""
        return signals.v[:, list(self.joints), None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """b v_j."""
        j = self.joints[0]
        return f"tau[{j}] += {real(values[0])} * v[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = weight."""
        return Cotangents(v=signals.only(self.joints[0], weights[:, 0, 0]))

    def urdf(self, values: Array) -> dict[str, float]:
        """`damping`."""
        return {"damping": float(values[0])}

    def mjcf(self, values: Array) -> dict[str, float]:
        """`damping`."""
        return {"damping": float(values[0])}
