"""Inertia of motor and gear, turning with the joint: τ_j = I_a a_j.

On joints that turn about one fixed direction it indistinguishable from the link's own inertia.
"""

from collections.abc import Sequence
from typing import ClassVar

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array


class Armature(Effect):
    """τ_j = I_a a_j, I_a ≥ 0."""

    kind: ClassVar = "armature"
    title: ClassVar = "inertia of the motor (armature)"
    signature: ClassVar = "the residual is a straight line through zero over the acceleration"
    function_of: ClassVar = ("acceleration",)
    parameters: ClassVar = (Parameter("inertia", "kg·m²", 0.01, 30.0, nonnegative=True),)
    prior_cost: ClassVar = 1.0
    usual: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """a_j, (T, 1, 1)."""
        return signals.a[:, list(self.joints), None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """I a_j."""
        j = self.joints[0]
        return f"tau[{j}] += {real(values[0])} * a[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂a_j = weight."""
        return Cotangents(a=signals.only(self.joints[0], weights[:, 0, 0]))

    def mjcf(self, values: Array) -> dict[str, float]:
        """`armature`."""
        return {"armature": float(values[0])}
