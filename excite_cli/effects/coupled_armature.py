"""Rotor of a gear that is coupled with its neighbour's, as in the wrists of many arms.

The rotor of a shaft that turns with v_j + s v_k, s = ±1, has the energy ½ I (v_j + s v_k)²:

    τ_j = s I a_k,    τ_k = s I a_j

beside I a_j and I a_k, which are left to the joints' own rotors. The friction of that shaft is
`coupled_friction`.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Scope, Signals
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array


class CoupledArmature(Effect):
    """τ_j = c a_k and τ_k = c a_j with c = s I."""

    kind: ClassVar = "coupled_armature"
    title: ClassVar = "inertia of the motor of coupled gears"
    signature: ClassVar = "a joint's residual follows its neighbour's acceleration, and the reverse"
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (Parameter("inertia", "kg·m²", 0.01, 3.0),)

    def columns(self, signals: Signals) -> Array:
        """a_k and a_j, (T, 2, 1)."""
        return signals.a[:, list(self.joints)[::-1], None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """c a_k, c a_j."""
        (j, k), c = self.joints, real(values[0])
        return f"tau[{j}] += {c} * a[{k}];\ntau[{k}] += {c} * a[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂a of either joint is the other row's weight."""
        back = np.zeros_like(signals.a)
        back[:, list(self.joints)] = weights[:, ::-1, 0]
        return Cotangents(a=back)
