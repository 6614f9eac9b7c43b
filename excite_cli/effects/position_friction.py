"""Friction that changes over a turn of the joint: a gear out of centre, a seal that rubs.

    τ_j = (c cos(N q_j) + s sin(N q_j)) sgn(v_j) |v_j|^p,     N = 1 or 2 periods per turn;

its mean over the turn is Coulomb friction where p = 0 (dry), viscous friction where p = 1.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from excite_cli.effects.angle_curve import hats_over_angle
from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals, Value
from excite_cli.effects.judgement import Seen
from excite_cli.effects.mechanism import real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array, Robot

_PERIODS = (1.0, 2.0)  # per turn: out of centre, out of round
_POWERS = (0.0, 1.0)  # of the speed: dry, viscous


class PositionFriction(Effect):
    """τ_j = (cos · cos(N q_j) + sin · sin(N q_j)) sgn(v_j) |v_j|^power, N = `periods` per turn."""

    kind: ClassVar = "position_friction"
    title: ClassVar = "friction that depends on the angle"
    signature: ClassVar = "friction is more at one angle of the joint than at another"
    function_of: ClassVar = ("position", "speed")
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("cos", "N·m", 0.05, 100.0, part_of_torque=True),
        Parameter("sin", "N·m", 0.05, 100.0, part_of_torque=True),
    )
    shapes: ClassVar = (Parameter("periods", "1/turn", 1.0, 2.0), Parameter("power", "1", 0.0, 1.0))
    defaults: ClassVar = {"periods": 1.0, "power": 0.0}
    prior_cost: ClassVar = 15.0
    refines: ClassVar = ("coulomb_friction", "viscous_friction")
    varies: ClassVar = refines
    holds_until_beaten: ClassVar = 0.05

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """Joints that turn."""
        return [(j,) for j in range(robot.base_joints, robot.n) if not robot.sliding[j]]

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Once and twice per turn, dry and viscous."""
        return [{"periods": periods, "power": power} for power in _POWERS for periods in _PERIODS]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """None: both are whole numbers."""
        return ()

    @property
    def _viscous(self) -> bool:
        return self.shape.get("power") == 1.0

    @property
    def varied(self) -> str:
        """Coulomb friction, or viscous friction."""
        return self.varies[self._viscous]

    @property
    def builds_on(self) -> tuple[str, ...]:
        """What it is the change of."""
        return (self.varied,)

    def compares_with(self, other: Effect) -> bool:
        """No: once and twice a turn are as unlike as dry and viscous."""
        return False

    @property
    def imitates(self) -> bool:
        """On a short way it is what is its mean over a turn."""
        return True

    def taken(self, values: Array) -> tuple[float, Array]:
        """Its amplitude: friction is nowhere negative."""
        amplitude = float(np.hypot(*values))
        return amplitude, values / max(amplitude, 1e-300)

    def absurd(self, values: Array, seen: Seen) -> str:
        """Of dry friction, what is no part of the torque; viscous friction is any at low speeds."""
        return "" if self._viscous else super().absurd(values, seen)

    def columns(self, signals: Signals) -> Array:
        """cos(N q_j) and sin(N q_j) times sgn v_j or v_j, (T, 1, 2)."""
        j = self.joints[0]
        angle = self.shape["periods"] * signals.q[:, j]
        around = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return (around * self._of_speed(signals.v[:, j])[0][:, None])[:, None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """(c cos N q_j + d sin N q_j) times v_j or its sign."""
        j, (c, d) = self.joints[0], map(real, values)
        angle = f"{real(self.shape['periods'])} * q[{j}]"
        of_speed = f"{'v' if self._viscous else 's'}[{j}]"
        return f"tau[{j}] += ({c} * cos({angle}) + {d} * sin({angle})) * {of_speed};"

    def _of_speed(self, v: Array) -> tuple[Array, Array]:
        """What the speed makes of friction (T,), and its derivative."""
        if self._viscous:
            return v, np.ones_like(v)
        return smooth_sign(v), smooth_sign_slope(v)

    def curve(self, signals: Signals, every: Sequence[Signals]) -> Array | None:
        """Friction of any form over the travelled range: eight hats."""
        j = self.joints[0]
        hats = hats_over_angle(j, signals, every)
        return (hats * self._of_speed(signals.v[:, j])[0][:, None])[:, None]

    def abscissa(self, signals: Signals) -> Abscissa:
        """The angle, folded into one period."""
        period = 2 * np.pi / self.shape["periods"]
        return Abscissa("angle within a period", "rad", signals.q[:, self.joints[0]], period)

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂q_j = N g(v) (w_s cos − w_c sin); ∂/∂v_j = g'(v) (w_c cos + w_s sin)."""
        j, n = self.joints[0], self.shape["periods"]
        angle, w = n * signals.q[:, j], weights[:, 0]
        of_speed, slope = self._of_speed(signals.v[:, j])
        cos, sin = np.cos(angle), np.sin(angle)
        by_q = n * of_speed * (w[:, 1] * cos - w[:, 0] * sin)
        by_v = slope * (w[:, 0] * cos + w[:, 1] * sin)
        return Cotangents(q=signals.only(j, by_q), v=signals.only(j, by_v))

    def report(self, values: Array, covariance: Array) -> dict[str, Value]:
        """Both amplitudes in the unit of the friction that they change."""
        found = super().report(values, covariance)
        if self._viscous:
            for each in self.parameters:
                found[each.name] = replace(found[each.name], unit="N·m·s/rad")
        return found
