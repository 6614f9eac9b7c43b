"""Friction that changes during a run, as oil and grease warm up: τ_j = t (ċ sgn v_j + ḃ v_j).

t counts from the start of the run, so every run drifts anew: `friction_change` goes on from one
recording to the next. Warming up makes both rates negative. Rates of opposite signs are no drift:
they are what a curve over speed becomes where a run is faster at its end than at its start.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals, Tier
from excite_cli.effects.judgement import half_of, nearest_of_sign
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array


class FrictionDrift(Effect):
    """τ_j = t (coulomb_rate · sgn v_j + viscous_rate · v_j), both of either sign, but the same."""

    kind: ClassVar = "friction_drift"
    over_time: ClassVar = True
    title: ClassVar = "friction that drifts during a run"
    signature: ClassVar = "friction is not the same at the end of a run as at its start"
    function_of: ClassVar = ("speed", "time")
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("coulomb_rate", "N·m/s", 1e-3, 1.0),
        Parameter("viscous_rate", "N·m/rad", 1e-3, 1.0),
    )
    prior_cost: ClassVar = 15.0  # within the seconds of a run, friction hardly warms up
    tier: ClassVar = Tier.LAST
    refines: ClassVar = ("viscous_friction", "coulomb_friction")
    deviates_from: ClassVar = refines

    def columns(self, signals: Signals) -> Array:
        """t sgn v_j and t v_j, (T, 1, 2)."""
        v = signals.v[:, self.joints[0]]
        return (signals.t[:, None] * np.stack([smooth_sign(v), v], axis=-1))[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """t (c sgn v_j + b v_j)."""
        j, (c, b) = self.joints[0], map(real, values)
        return f"tau[{j}] += t * ({c} * s[{j}] + {b} * v[{j}]);"

    def possible(self, values: Array) -> bool:
        """Whether both rates have the same sign: friction falls, or rises, as a whole."""
        return bool(values[0] * values[1] >= 0.0)

    def nearest(self, values: Array, covariance: Array) -> Array:
        """The nearest rates of the same sign, in units of their error."""
        if self.possible(values):
            return values
        both = np.ones(2, dtype=bool)
        found = [s * nearest_of_sign(s * values, covariance, both) for s in (1.0, -1.0)]
        whiten = np.linalg.inv(half_of(covariance))
        return min(found, key=lambda near: float(np.linalg.norm(whiten @ (values - near))))

    def why_not(self, values: Array) -> str:
        """Why rates are not `possible`."""
        return "dry and viscous friction do not drift in opposite directions"

    def abscissa(self, signals: Signals) -> Abscissa:
        """Time with the sign of the speed."""
        sign = smooth_sign(signals.v[:, self.joints[0]])
        return Abscissa("time, signed by the direction", "s", signals.t * sign)

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂v_j = t (weight₁ · slope of the sign + weight₂)."""
        j = self.joints[0]
        slope = weights[:, 0, 0] * smooth_sign_slope(signals.v[:, j]) + weights[:, 0, 1]
        return Cotangents(v=signals.only(j, signals.t * slope))
