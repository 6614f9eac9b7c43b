"""Friction that follows a column of the log: τ_j = (c − c₀) (k_c sgn v_j + k_b v_j).

Temperature is the usual one: viscous friction halves within some 20 K, dry friction changes too.
Coulomb and viscous friction beside it are those at the reference c₀. What changes with time alone
is `friction_change` or `friction_drift`; which of them it is, the data say: a robot that pauses
cools down.
"""

from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Parameter, Signals
from excite_cli.effects.of_covariate import PER_UNIT, OfCovariate
from excite_cli.effects.sign import smooth_sign
from excite_cli.robot.model import Array


class CovariateFriction(OfCovariate):
    """τ_j = (c − c₀) (coulomb_slope · sgn v_j + viscous_slope · v_j), of either sign."""

    kind: ClassVar = "covariate_friction"
    title: ClassVar = "friction that follows a column of the log"
    signature: ClassVar = "friction is not the same where the column is high as where it is low"
    function_of: ClassVar = ("speed", "covariate")
    parameters: ClassVar = (
        Parameter("coulomb_slope", f"N·m{PER_UNIT}", 1e-3, 10.0),
        Parameter("viscous_slope", f"N·m·s/rad{PER_UNIT}", 1e-3, 10.0),
    )
    refines: ClassVar = ("coulomb_friction", "viscous_friction")
    changes_of: ClassVar = refines
    excludes: ClassVar = ("friction_change",)  # warming by the clock instead of the thermometer

    def columns(self, signals: Signals) -> Array:
        """δ sgn v_j and δ v_j, (T, 1, 2)."""
        v = signals.v[:, self.joints[0]]
        both = np.stack([smooth_sign(v), v], axis=-1)
        return (self.deviation_of(signals)[:, None] * both)[:, None]

    def abscissa(self, signals: Signals) -> Abscissa:
        """The column's deviation from its reference with the sign of the speed."""
        sign = smooth_sign(signals.v[:, self.joints[0]])
        name = f"{self.covariate} less its reference, signed by the direction"
        return Abscissa(name, "unit", self.deviation_of(signals) * sign)
