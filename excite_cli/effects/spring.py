"""A spring at the joint, or a compensator of gravity: τ_j = k q_j + c = k (q_j − q_0)."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.angle_curve import powers_of_angle
from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Value, deviation
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array


class Spring(Effect):
    """τ_j = stiffness · q_j + preload; the spring rests at q_0 = −preload/stiffness."""

    kind: ClassVar = "spring"
    size: ClassVar = ("stiffness",)
    title: ClassVar = "spring at the joint"
    signature: ClassVar = "the residual is a straight line over the joint's angle"
    function_of: ClassVar = ("position",)
    parameters: ClassVar = (
        Parameter("stiffness", "N·m/rad", 0.5, 2000.0, nonnegative=True),
        Parameter("preload", "N·m", 0.1, 2000.0),
    )
    # With less, a constant is called a preloaded spring as soon as noise bends it.
    prior_cost: ClassVar = 12.0
    usual: ClassVar = True
    # Of a real one (KR300's, hydraulic) a curve takes more than 5 % off, of k q³ nearly all.
    holds_until_beaten: ClassVar = 0.5

    def columns(self, signals: Signals) -> Array:
        """q_j and 1, (T, 1, 2)."""
        q = signals.q[:, self.joints[0]]
        return np.stack([q, np.ones_like(q)], axis=-1)[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """k q_j + b."""
        j, (stiffness, preload) = self.joints[0], map(real, values)
        return f"tau[{j}] += {stiffness} * q[{j}] + {preload};"

    def curve(self, signals: Signals, every: Sequence[Signals]) -> Array | None:
        """Powers of the angle up to the fourth: a spring that hardens is another."""
        return powers_of_angle(self.joints[0], signals, every)[:, None]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂q_j = weight of the stiffness."""
        return Cotangents(q=signals.only(self.joints[0], weights[:, 0, 0]))

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Also `rest_position` = −c/k, its deviation to first order."""
        found = super().report(values, covariance)
        k, c = (float(value) for value in values)
        if k != 0.0:
            slope = np.array([c / k**2, -1.0 / k])
            found["rest_position"] = Value(-c / k, deviation(slope, covariance), "rad")
        return found

    @classmethod
    def planted(cls, value: float, others: Mapping[str, float]) -> tuple[dict[str, float], Array]:
        """Stiffness `value`; others: `rest_position` [rad] (0) or `preload` [N·m]."""
        rest = -value * others.get("rest_position", 0.0)
        return {}, np.array([value, others.get("preload", rest)])

    def mjcf(self, values: Array) -> dict[str, float]:
        """`stiffness` and `springref`; MuJoCo has no springs that push away."""
        k, c = (float(value) for value in values)
        return {"stiffness": k, "springref": -c / k} if k > 0 else {}
