"""Friction that follows a column of the log: τ_j = δ (k_c sgn v_j + k_b v_j),

    δ = (1 − exp(−κ (c − c₀))) / κ,    c − c₀ for κ = 0.

Temperature is the usual one: viscous friction halves within some 20 K, dry friction changes too.
Oil thins as exp(−κ c): of friction that falls to a half, a straight line leaves a tenth of what it
explains, in RMS, and a curve over time, which has a time constant of its own, would be named.
Coulomb and viscous friction beside it are those at the reference c₀. What changes with time alone
is `friction_change` or `friction_drift`; which of them it is, the data say: a robot that pauses
cools down.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Parameter, Signals
from excite_cli.effects.mechanism import real
from excite_cli.effects.of_covariate import PER_UNIT, OfCovariate
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array, Robot

_GRID = (0.0, 0.7, 1.5, -0.7)  # κ times what the column varies by; falling to a half is 0.7
_STEPS = (1.5, 0.7, 0.3, 0.12, 0.05)  # κ times what the column varies by
_MOST = 4.0  # κ times what it varies by: a cold start, and nothing after it
_STRAIGHT = 1e-9


class CovariateFriction(OfCovariate):
    """τ_j = δ (coulomb_slope · sgn v_j + viscous_slope · v_j), of either sign."""

    kind: ClassVar = "covariate_friction"
    title: ClassVar = "friction that follows a column of the log"
    signature: ClassVar = "friction is not the same where the column is high as where it is low"
    function_of: ClassVar = ("speed", "covariate")
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("coulomb_slope", f"N·m{PER_UNIT}", 1e-3, 10.0),
        Parameter("viscous_slope", f"N·m·s/rad{PER_UNIT}", 1e-3, 10.0),
    )
    shapes: ClassVar = (*OfCovariate.shapes, Parameter("curvature", f"1{PER_UNIT}", 1e-3, 0.1))
    defaults: ClassVar[Mapping[str, float]] = {**OfCovariate.defaults, "curvature": 0.0}
    refines: ClassVar = ("coulomb_friction", "viscous_friction")
    changes_of: ClassVar = refines
    excludes: ClassVar = ("friction_change",)  # warming by the clock instead of the thermometer

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """A straight line about the mean, and curves."""
        found = super().grid(robot, joints, signals)
        if not found:
            return []
        range_ = _range(next(iter(each.covariates.values())) for each in signals)
        return [{**found[0], "curvature": bent / range_} for bent in _GRID]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """Curvatures by what the column varies by."""
        if name != "curvature":
            return ()
        range_ = _range(seen.covariates[self.covariate] for seen in signals)
        own = self.shape.get(name, 0.0)
        return [s / range_ for s in _STEPS if abs(own) * range_ + s <= _MOST]

    def deviation_of(self, signals: Signals) -> Array:
        """δ (T,)."""
        straight, curvature = super().deviation_of(signals), self.shape.get("curvature", 0.0)
        if abs(curvature) * np.abs(straight).max(initial=0.0) < _STRAIGHT:
            return straight
        return np.asarray(-np.expm1(-curvature * straight) / curvature)

    def columns(self, signals: Signals) -> Array:
        """δ sgn v_j and δ v_j, (T, 1, 2)."""
        v = signals.v[:, self.joints[0]]
        both = np.stack([smooth_sign(v), v], axis=-1)
        return (self.deviation_of(signals)[:, None] * both)[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """δ (c sgn v_j + b v_j)."""
        j, (c, b) = self.joints[0], map(real, values)
        bent, delta = self.shape.get("curvature", 0.0), self.deviation_in_c(columns)
        if bent:
            delta = f"(-expm1({real(-bent)} * {delta}) / {real(bent)})"
        return f"tau[{j}] += {delta} * ({c} * s[{j}] + {b} * v[{j}]);"

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = δ (w_c · slope of the sign + w_v)."""
        j, w = self.joints[0], self.deviation_of(signals)[:, None] * weights[:, 0]
        slope = smooth_sign_slope(signals.v[:, j])
        return Cotangents(v=signals.only(j, w[:, 0] * slope + w[:, 1]))

    def abscissa(self, signals: Signals) -> Abscissa:
        """The column's deviation from its reference with the sign of the speed."""
        sign = smooth_sign(signals.v[:, self.joints[0]])
        name = f"{self.covariate} less its reference, signed by the direction"
        return Abscissa(name, "unit", self.deviation_of(signals) * sign)


def _range(columns: Iterable[Array]) -> float:
    """Highest less lowest value of all of them."""
    lows, highs = zip(*((float(c.min()), float(c.max())) for c in columns), strict=True)
    return max(highs) - min(lows)
