"""Dry asymmetric friction (differs between the directions).

τ_j = f⁺ for v_j > 0 and −f⁻ for v_j < 0. It *is* Coulomb friction plus an offset:
f_c = (f⁺ + f⁻)/2 and b = (f⁺ − f⁻)/2, the same two columns in another basis.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Tier
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array


class AsymmetricFriction(Effect):
    """τ_j = f⁺ (1 + sgn v_j)/2 − f⁻ (1 − sgn v_j)/2, both ≥ 0."""

    kind: ClassVar = "asymmetric_friction"
    title: ClassVar = "direction-dependent friction"
    signature: ClassVar = "the residual jumps when the joint reverses, to levels of unequal height"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("forward", "N·m", 0.05, 300.0, nonnegative=True, part_of_torque=True),
        Parameter("backward", "N·m", 0.05, 300.0, nonnegative=True, part_of_torque=True),
    )
    tier: ClassVar = Tier.LAST
    refines: ClassVar = ("coulomb_friction", "torque_offset")
    same_as: ClassVar = refines

    def columns(self, signals: Signals) -> Array:
        """(1 + sgn v_j)/2 and −(1 − sgn v_j)/2, (T, 1, 2)."""
        sign = smooth_sign(signals.v[:, self.joints[0]])
        return 0.5 * np.stack([sign + 1.0, sign - 1.0], axis=-1)[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """f⁺ (s + 1)/2 + f⁻ (s − 1)/2."""
        j, (forward, backward) = self.joints[0], map(real, 0.5 * values)
        return f"tau[{j}] += {forward} * (s[{j}] + 1) + {backward} * (s[{j}] - 1);"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = (sum of both weights) · slope of the smoothed sign / 2."""
        j = self.joints[0]
        slope = 0.5 * smooth_sign_slope(signals.v[:, j])
        return Cotangents(v=signals.only(j, weights[:, 0].sum(axis=-1) * slope))
