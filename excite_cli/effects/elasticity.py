"""An elastic gear: two inertias with a spring in between, seen from the motor's encoder.

The spring turns by c τ_j, c = 1/K, so the link is at q_j − c τ_j. To first order in c the torque
of all joints changes by

    −c (∂τ/∂q_j τ_j + ∂τ/∂v_j dτ_j/dt + ∂τ/∂a_j d²τ_j/dt²),     τ the rigid-body torque.

With an encoder at the link nothing of this shows.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Cotangents, Effect, Parameter, Signals, Tier, Value
from excite_cli.effects.directional import slope_of_gradient
from excite_cli.effects.judgement import Seen
from excite_cli.effects.mechanism import all_joints, real
from excite_cli.effects.simulated_robot import SimulatedRobot, Transmission, rotor_inertia
from excite_cli.robot.model import Array

_MISSED = 0.12  # of the compliance, one standard deviation; measured on simulated soft gears
_MOST_BENT = 0.1  # rad, under the RMS of the load; harmonic drives bend by a few mrad


class Elasticity(Effect):
    """The gear of one joint turns by compliance · load_j; shows in all rows."""

    kind: ClassVar = "elasticity"
    over_time: ClassVar = True
    title: ClassVar = "elastic gear"
    signature: ClassVar = "the residual follows the fourth derivative of the motion, on many joints"
    in_all_rows: ClassVar = True
    parameters: ClassVar = (Parameter("compliance", "rad/(N·m)", 1e-6, 1e-3, nonnegative=True),)
    tier: ClassVar = Tier.LAST
    excludes: ClassVar = ("backlash",)
    settings: ClassVar[Mapping[str, float]] = {"rotor_inertia": 0.0, "damping_ratio": 0.02}

    def absurd(self, values: Array, seen: Seen) -> str:
        """No arm hangs in its gears by more than a tenth of a radian."""
        bent = float(values[0] * seen.load[self.joints[0]])
        if bent <= _MOST_BENT:
            return ""
        stiffness = 1.0 / values[0]
        return (
            f"a gear of {stiffness:.3g} N·m/rad (N/m) would bend by {bent:.2g} rad (m) under its "
            "usual load"
        )

    def model_error(self, values: Array) -> Array:
        """What the next order, (motion's frequency over the resonance)², makes of it."""
        return _MISSED * values

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """A rotor and a link with a spring and a damper between them."""
        given = numbers["rotor_inertia"]
        for j in self.joints:
            stiffness = 1.0 / max(numbers["compliance"], 1e-9)
            rotor = rotor_inertia(robot, j, given)
            inertia = robot.link_inertia(j)
            damping = 2.0 * numbers["damping_ratio"] * np.sqrt(stiffness * inertia)
            robot.soft[j] = Transmission(rotor, given > 0.0, stiffness, float(damping))

    def columns(self, signals: Signals) -> Array:
        """−(∂τ/∂q_j τ_j + ∂τ/∂v_j dτ_j/dt + ∂τ/∂a_j d²τ_j/dt²), (T, n, 1)."""
        j, body = self.joints[0], signals.body
        parts = (body.by_position, body.by_velocity, body.mass)
        twists = self._twist(signals)[:, :, None, None]
        return -sum(part[:, :, [j]] * twist for part, twist in zip(parts, twists, strict=True))

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """−c (∂τ/∂q_j load_j + ∂τ/∂v_j load_j' + ∂τ/∂a_j load_j'')."""
        j, c = self.joints[0], real(-float(values[0]))
        rates = (f"{c} * {name}[{j}]" for name in ("load", "load_rate", "load_bend"))
        return all_joints(f"slopes(q, v, a, {j}, {', '.join(rates)}, out)")

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """Through τ_j and its rates, and through the derivatives (`slope_of_gradient`)."""
        j, body, w = self.joints[0], signals.body, -weights[:, :, 0]
        d_q, d_v, d_a = (signals.only(j, x) for x in self._twist(signals))
        gq, gv, ga = slope_of_gradient(body, w, d_q, d_v, d_a)
        by_q, by_v, by_a = (
            np.einsum("tr,tr->t", w, part[:, :, j])
            for part in (body.by_position, body.by_velocity, body.mass)
        )
        load = by_q + signals.rate_back(by_v + signals.rate_back(by_a))
        return Cotangents(q=gq, v=gv, a=ga, load=signals.only(j, load))

    def _twist(self, signals: Signals) -> Array:
        """τ_j and its first and second rates, (3, T)."""
        load = signals.load[:, self.joints[0]]
        rate = signals.rate(load)
        return np.stack([load, rate, signals.rate(rate)])

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Also `stiffness` = 1/compliance, its deviation to first order."""
        found = super().report(values, covariance)
        c = found["compliance"]
        if c.value > 0:
            found["stiffness"] = Value(1.0 / c.value, c.std / c.value**2, "N·m/rad")
        return found
