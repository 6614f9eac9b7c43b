"""A gear that loses more, or less, of what it carries when it drives than when it is driven.

    τ_j = μ₁ |load_j| sgn v_j where load_j v_j > 0 (the motor drives), μ₂ |load_j| sgn v_j elsewhere
        = ½ (μ₁ + μ₂) |load_j| sgn v_j + ½ (μ₁ − μ₂) load_j,

and at standstill anything between both: the second form has the middle of that there.

With μ₁ = μ₂ it *is* load-dependent friction. The difference is the torque of a wrong gain, so that
a joint that has both looks like this; where the gain exceeds the friction it is no gear loss: μ₁ or
μ₂ would be below zero.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array


class GearLoss(Effect):
    """τ_j = μ₁ |load_j| sgn v_j where load_j v_j > 0, μ₂ |load_j| sgn v_j elsewhere; both ≥ 0."""

    kind: ClassVar = "gear_loss"
    title: ClassVar = "gear loss, driving and back-driving"
    signature: ClassVar = "friction grows with the load, more where the motor drives than where not"
    function_of: ClassVar = ("speed", "load")
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("driving", "N·m/N·m", 0.005, 0.3, nonnegative=True),
        Parameter("back_driving", "N·m/N·m", 0.005, 0.3, nonnegative=True),
    )
    prior_cost: ClassVar = 4.0
    refines: ClassVar = ("coulomb_friction",)
    same_as: ClassVar = ("load_dependent_friction", "torque_gain")
    # Beside one of them its losses would only be known up to a common part, of any sign.
    excludes: ClassVar = same_as
    deviates_from: ClassVar = ("viscous_friction", "coulomb_friction")
    identified_by: ClassVar = "one run carries a known payload (identification.known_payload)"

    def columns(self, signals: Signals) -> Array:
        """(|load_j| sgn v_j ± load_j)/2, (T, 1, 2)."""
        j = self.joints[0]
        load = signals.load[:, j]
        dry = np.abs(load) * smooth_sign(signals.v[:, j])
        return 0.5 * np.stack([dry + load, dry - load], axis=-1)[:, None]

    def nearest(self, values: Array, covariance: Array) -> Array:
        """Themselves: a gear loses both ways, and with a loss below zero other names fit as well.

        Beside a torque that saturates, losses of −0.13 and 0.17 stood for friction of 0.07.
        """
        return values

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """(μ₁ + μ₂)/2 |load_j| s + (μ₁ − μ₂)/2 load_j."""
        j = self.joints[0]
        mean, half = real(0.5 * (values[0] + values[1])), real(0.5 * (values[0] - values[1]))
        return f"tau[{j}] += {mean} * fabs(load[{j}]) * s[{j}] + {half} * load[{j}];"

    def abscissa(self, signals: Signals) -> Abscissa:
        """The column of load-dependent friction: of either loss a straight line over it."""
        return Abscissa("load, signed by the direction", "N·m", self.columns(signals).sum((1, 2)))

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = w₊ |load_j| · slope of sgn v_j; ∂/∂load_j = w₊ sgn load_j sgn v_j + w₋.

        w₊ and w₋ are half the sum and half the difference of both weights.
        """
        j = self.joints[0]
        load, v = signals.load[:, j], signals.v[:, j]
        mean = 0.5 * weights[:, 0].sum(axis=-1)
        half = 0.5 * (weights[:, 0, 0] - weights[:, 0, 1])
        return Cotangents(
            v=signals.only(j, mean * np.abs(load) * smooth_sign_slope(v)),
            load=signals.only(j, mean * np.sign(load) * smooth_sign(v) + half),
        )
