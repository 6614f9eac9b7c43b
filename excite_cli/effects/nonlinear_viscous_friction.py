"""Friction that grows with speed, but not in proportion: τ_j = f sgn(v_j) |v_j|^p.

p = 0.5 saturates, 2 and 3 grow. At standstill |v| is replaced by √(v² + w²), w the width of the
sign, without which p = 0.5 has no slope there: v (v² + w²)^((p−1)/2).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Value
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import sign_width
from excite_cli.robot.model import Array, Robot


class NonlinearViscousFriction(Effect):
    """τ_j = f sgn(v_j) |v_j|^power, f ≥ 0."""

    kind: ClassVar = "nonlinear_viscous_friction"
    title: ClassVar = "nonlinear viscous friction"
    signature: ClassVar = "the residual is odd in the joint's speed and bends"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("coefficient", "N·m·(s/rad)^power", 0.05, 100.0, nonnegative=True),
    )
    shapes: ClassVar = (Parameter("power", "1", 0.5, 3.0),)
    defaults: ClassVar = {"power": 2.0}
    prior_cost: ClassVar = 2.0
    refines: ClassVar = ("viscous_friction", "coulomb_friction")
    deviates_from: ClassVar = refines
    usual: ClassVar = True

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Powers 0.5, 2 and 3; 1 is viscous friction."""
        return [{"power": 0.5}, {"power": 2.0}, {"power": 3.0}]

    def columns(self, signals: Signals) -> Array:
        """sgn(v_j) |v_j|^p, (T, 1, 1)."""
        v = signals.v[:, list(self.joints), None]
        return v * (v**2 + sign_width() ** 2) ** ((self.shape["power"] - 1.0) / 2.0)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """f v_j (v_j² + w²)^((p−1)/2)."""
        j, half = self.joints[0], 0.5 * (self.shape["power"] - 1.0)
        square = f"v[{j}] * v[{j}] + {real(sign_width() ** 2)}"
        return f"tau[{j}] += {real(values[0])} * v[{j}] * pow({square}, {real(half)});"

    def mjcf(self, values: Array) -> dict[str, float]:
        """Damping by v|v| or v³, which MuJoCo has from version 4 on."""
        power = self.shape.get("power")
        return {f"damping_{power:.0f}": float(values[0])} if power in (2.0, 3.0) else {}

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = weight · (v² + w²)^((p−3)/2) (p v² + w²)."""
        j, p = self.joints[0], self.shape["power"]
        square, width = signals.v[:, j] ** 2, sign_width() ** 2
        slope = (square + width) ** ((p - 3.0) / 2.0) * (p * square + width)
        return Cotangents(v=signals.only(j, weights[:, 0, 0] * slope))

    @property
    def imitates(self) -> bool:
        """√|v| comes near any friction; beside no Coulomb and viscous friction it is no physics."""
        return self.shape.get("power") == 0.5

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """None: the powers of the grid are all there are."""
        return ()

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """The coefficient in the unit that belongs to its power."""
        found = super().report(values, covariance)
        unit = f"N·m·(s/rad)^{self.shape['power']:g}"
        found["coefficient"] = replace(found["coefficient"], unit=unit)
        return found
