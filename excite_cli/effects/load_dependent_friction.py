"""Dry friction that grows with what the gear carries: τ_j = μ |load_j| sgn v_j.

`load` is the rigid-body torque of the joint, not the friction itself.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array


class LoadDependentFriction(Effect):
    """τ_j = μ |load_j| sgn v_j, μ ≥ 0."""

    kind: ClassVar = "load_dependent_friction"
    title: ClassVar = "load-dependent friction"
    signature: ClassVar = "the jump at a reversal is the larger the more torque the joint carries"
    function_of: ClassVar = ("speed", "load")
    friction: ClassVar = True
    parameters: ClassVar = (Parameter("ratio", "N·m/N·m", 0.005, 0.3, nonnegative=True),)
    prior_cost: ClassVar = 1.0
    refines: ClassVar = ("coulomb_friction",)
    deviates_from: ClassVar = ("viscous_friction", "coulomb_friction")
    usual: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        """|load_j| sgn v_j, (T, 1, 1)."""
        j = list(self.joints)
        return (np.abs(signals.load[:, j]) * smooth_sign(signals.v[:, j]))[:, :, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """μ |load_j| sgn v_j."""
        j = self.joints[0]
        return f"tau[{j}] += {real(values[0])} * fabs(load[{j}]) * s[{j}];"

    def abscissa(self, signals: Signals) -> Abscissa:
        """The column itself: friction is a straight line over it."""
        return Abscissa("load, signed by the direction", "N·m", self.columns(signals)[:, 0, 0])

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = weight · |load| · slope of the sign; ∂/∂load_j = weight · sgn load · sgn v."""
        j = self.joints[0]
        w, v, load = weights[:, 0, 0], signals.v[:, j], signals.load[:, j]
        return Cotangents(
            v=signals.only(j, w * np.abs(load) * smooth_sign_slope(v)),
            load=signals.only(j, w * np.sign(load) * smooth_sign(v)),
        )
