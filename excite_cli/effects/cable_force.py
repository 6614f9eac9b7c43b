"""Force of a hose or cable along two joints: a smooth potential of both angles.

U = c₁ q_j q_k + c₂ q_j² q_k + c₃ q_j q_k², torque = ∂U/∂q in both rows: it is conservative.
Terms of one angle alone are springs.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Scope, Signals, Tier
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array


class CableForce(Effect):
    """τ_j = c₁ q_k + 2 c₂ q_j q_k + c₃ q_k², τ_k = c₁ q_j + c₂ q_j² + 2 c₃ q_j q_k."""

    kind: ClassVar = "cable_force"
    title: ClassVar = "force of a cable or hose"
    signature: ClassVar = "a joint's residual depends on a neighbour's angle at any speed"
    function_of: ClassVar = ("position",)
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (
        Parameter("bilinear", "N·m/rad", 0.1, 100.0),
        Parameter("first_squared", "N·m/rad²", 0.1, 100.0),
        Parameter("second_squared", "N·m/rad²", 0.1, 100.0),
    )
    prior_cost: ClassVar = 25.0  # three functions of two angles come near an offset or a spring
    tier: ClassVar = Tier.LAST

    def columns(self, signals: Signals) -> Array:
        """Gradients of q_j q_k, q_j² q_k and q_j q_k², (T, 2, 3)."""
        x, y = signals.q[:, self.joints[0]], signals.q[:, self.joints[1]]
        rows = [[y, 2 * x * y, y * y], [x, x * x, 2 * x * y]]
        return np.moveaxis(np.array(rows), 2, 0)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """Gradients of the three potentials."""
        (j, k), (b, first, second) = self.joints, map(real, values)
        x, y = f"q[{j}]", f"q[{k}]"
        return (
            f"tau[{j}] += {b} * {y} + 2 * {first} * {x} * {y} + {second} * {y} * {y}; "
            f"tau[{k}] += {b} * {x} + {first} * {x} * {x} + 2 * {second} * {x} * {y};"
        )

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """The symmetric second derivatives of the three potentials."""
        x, y = signals.q[:, self.joints[0]], signals.q[:, self.joints[1]]
        (j1, j2, j3), (k1, k2, k3) = np.moveaxis(weights, 0, 2)
        back = np.zeros_like(signals.q)
        back[:, self.joints[0]] = 2 * y * j2 + k1 + 2 * x * k2 + 2 * y * k3
        back[:, self.joints[1]] = j1 + 2 * x * j2 + 2 * y * j3 + 2 * x * k3
        return Cotangents(q=back)
