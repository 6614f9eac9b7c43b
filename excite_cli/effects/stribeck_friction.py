"""More dry friction at low speed: τ_j = Δf |load_j|^p exp(−(v_j/v_s)²) sgn v_j, p zero or one."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Value
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array, Robot

_LEAST_SPEED = 0.005  # rad/s; below it the peak is as narrow as the smoothed sign
_SHARES = np.geomspace(0.01, 0.3, 5)  # of the joint's largest speed


class StribeckFriction(Effect):
    """τ_j = Δf |load_j|^p exp(−(v_j/v_s)²) sgn v_j, Δf ≥ 0, p = `load_power`."""

    kind: ClassVar = "stribeck_friction"
    title: ClassVar = "Stribeck friction"
    signature: ClassVar = "friction is highest just after a reversal and falls with speed"
    function_of: ClassVar = ("speed",)
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("excess", "N·m", 0.05, 100.0, nonnegative=True, part_of_torque=True),
    )
    shapes: ClassVar = (
        Parameter("stribeck_speed", "rad/s", _LEAST_SPEED, 1.0),
        Parameter("load_power", "1", 0.0, 1.0),
    )
    defaults: ClassVar = {"stribeck_speed": 0.1, "load_power": 0.0}
    prior_cost: ClassVar = 2.0
    refines: ClassVar = ("viscous_friction", "coulomb_friction")
    deviates_from: ClassVar = refines

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Five speeds from 1 to 30 % of the largest one seen, none below 5 mrad/s; load power 0.

        Sought as well, that named less, and left more, on two of five real logs.
        """
        j = joints[0]
        fastest = max((float(np.abs(s.v[:, j]).max()) for s in signals if len(s.v)), default=1.0)
        speeds = np.unique(np.maximum(_SHARES * fastest, _LEAST_SPEED))
        return [{"stribeck_speed": float(speed), "load_power": 0.0} for speed in speeds]

    @property
    def _by_load(self) -> bool:
        return self.shape.get("load_power") == 1.0

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """Of the speed only."""
        return () if name == "load_power" else super().finer_steps(name, signals)

    def compares_with(self, other: Effect) -> bool:
        """Of the same form: sizes of the other are in other units."""
        return self.shape.get("load_power", 0.0) == other.shape.get("load_power", 0.0)

    def shows_above(self, speed: float) -> bool:
        """Whether its peak reaches beyond the samples in which the joint hardly moves."""
        return self.shape.get("stribeck_speed", np.inf) >= speed

    def columns(self, signals: Signals) -> Array:
        """|load_j|^p exp(−(v_j/v_s)²) sgn v_j, (T, 1, 1)."""
        j = self.joints[0]
        v = signals.v[:, j]
        peak = np.exp(-((v / self.shape["stribeck_speed"]) ** 2)) * smooth_sign(v)
        return (self._borne(signals) * peak)[:, None, None]

    def _borne(self, signals: Signals) -> Array:
        """|load_j|^p (T,)."""
        j = self.joints[0]
        return np.abs(signals.load[:, j]) if self._by_load else np.ones_like(signals.v[:, j])

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """Δf |load_j|^p exp(−(v_j/v_s)²) sgn v_j."""
        j = self.joints[0]
        ratio = f"v[{j}] / {real(self.shape['stribeck_speed'])}"
        peak = f"exp(-({ratio}) * ({ratio}))"
        borne = f" * fabs(load[{j}])" if self._by_load else ""
        return f"tau[{j}] += {real(values[0])}{borne} * {peak} * s[{j}];"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = w |load|^p e (slope of the sign − 2 v/v_s² · sign), e = exp(−(v/v_s)²).

        ∂/∂load_j = w p sgn load · e sgn v, with w the weight.
        """
        j, speed = self.joints[0], self.shape["stribeck_speed"]
        v, w = signals.v[:, j], weights[:, 0, 0]
        peak, sign = np.exp(-((v / speed) ** 2)), smooth_sign(v)
        slope = peak * (smooth_sign_slope(v) - 2.0 * v / speed**2 * sign)
        by_load = self._by_load * np.sign(signals.load[:, j]) * peak * sign
        return Cotangents(
            v=signals.only(j, w * self._borne(signals) * slope),
            load=signals.only(j, w * by_load),
        )

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """The excess in its unit."""
        found = super().report(values, covariance)
        if self._by_load:
            found["excess"] = replace(found["excess"], unit="N·m/N·m")
        return found
