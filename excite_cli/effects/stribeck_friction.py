"""More dry friction at low speed: τ_j = Δf exp(−(v_j/v_s)²) sgn v_j."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array, Robot

_LEAST_SPEED = 0.005  # rad/s; below it the peak is as narrow as the smoothed sign
_SHARES = np.geomspace(0.01, 0.3, 5)  # of the joint's largest speed


class StribeckFriction(Effect):
    """τ_j = Δf exp(−(v_j/v_s)²) sgn v_j, Δf ≥ 0."""

    kind: ClassVar = "stribeck_friction"
    title: ClassVar = "Stribeck friction"
    signature: ClassVar = "friction is highest just after a reversal and falls with speed"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("excess", "N·m", 0.05, 100.0, nonnegative=True, part_of_torque=True),
    )
    shapes: ClassVar = (Parameter("stribeck_speed", "rad/s", _LEAST_SPEED, 1.0),)
    defaults: ClassVar = {"stribeck_speed": 0.1}
    prior_cost: ClassVar = 2.0
    refines: ClassVar = ("viscous_friction", "coulomb_friction")
    deviates_from: ClassVar = refines

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Five speeds from 1 to 30 % of the largest one seen, none below 5 mrad/s."""
        j = joints[0]
        fastest = max((float(np.abs(s.v[:, j]).max()) for s in signals if len(s.v)), default=1.0)
        speeds = np.unique(np.maximum(_SHARES * fastest, _LEAST_SPEED))
        return [{"stribeck_speed": float(speed)} for speed in speeds]

    def shows_above(self, speed: float) -> bool:
        """Whether its peak reaches beyond the samples in which the joint hardly moves."""
        return self.shape.get("stribeck_speed", np.inf) >= speed

    def columns(self, signals: Signals) -> Array:
        """exp(−(v_j/v_s)²) sgn v_j, (T, 1, 1)."""
        v = signals.v[:, list(self.joints), None]
        return np.exp(-((v / self.shape["stribeck_speed"]) ** 2)) * smooth_sign(v)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """Δf exp(−(v_j/v_s)²) sgn v_j."""
        j = self.joints[0]
        ratio = f"v[{j}] / {real(self.shape['stribeck_speed'])}"
        peak = f"exp(-({ratio}) * ({ratio}))"
        return f"tau[{j}] += {real(values[0])} * {peak} * s[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = weight · exp(−(v/v_s)²) (slope of the sign − 2 v/v_s² · sign)."""
        j, speed = self.joints[0], self.shape["stribeck_speed"]
        v = signals.v[:, j]
        slope = np.exp(-((v / speed) ** 2)) * (
            smooth_sign_slope(v) - 2.0 * v / speed**2 * smooth_sign(v)
        )
        return Cotangents(v=signals.only(j, weights[:, 0, 0] * slope))
