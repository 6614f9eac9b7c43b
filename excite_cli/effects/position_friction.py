"""Dry friction that changes over a turn of the joint: a gear out of centre, a seal that rubs.

    τ_j = (c cos(N q_j) + s sin(N q_j)) sgn v_j,     N = 1 or 2 periods per turn;

its mean over the turn is Coulomb friction.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Signals
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.robot.model import Array, Robot

_PERIODS = (1.0, 2.0)  # per turn: out of centre, out of round


class PositionFriction(Effect):
    """τ_j = (cos · cos(N q_j) + sin · sin(N q_j)) sgn v_j with N = `periods` per turn."""

    kind: ClassVar = "position_friction"
    title: ClassVar = "friction that depends on the angle"
    signature: ClassVar = "the jump at a reversal depends on the angle at which the joint reverses"
    function_of: ClassVar = ("position", "speed")
    friction: ClassVar = True
    parameters: ClassVar = (
        Parameter("cos", "N·m", 0.05, 100.0, part_of_torque=True),
        Parameter("sin", "N·m", 0.05, 100.0, part_of_torque=True),
    )
    shapes: ClassVar = (Parameter("periods", "1/turn", 1.0, 2.0),)
    defaults: ClassVar = {"periods": 1.0}
    refines: ClassVar = ("coulomb_friction",)
    varies: ClassVar = "coulomb_friction"

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """Joints that turn."""
        return [(j,) for j in range(robot.n) if not robot.sliding[j]]

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """Once and twice per turn."""
        return [{"periods": periods} for periods in _PERIODS]

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """None: it is a whole number."""
        return ()

    @property
    def imitates(self) -> bool:
        """On a short way it is Coulomb friction, which is its mean over a turn."""
        return True

    def taken(self, values: Array) -> tuple[float, Array]:
        """Its amplitude: friction is nowhere negative."""
        amplitude = float(np.hypot(*values))
        return amplitude, values / max(amplitude, 1e-300)

    def columns(self, signals: Signals) -> Array:
        """cos(N q_j) sgn v_j and sin(N q_j) sgn v_j, (T, 1, 2)."""
        j = self.joints[0]
        angle = self.shape["periods"] * signals.q[:, j]
        around = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return (around * smooth_sign(signals.v[:, j, None]))[:, None]

    def abscissa(self, signals: Signals) -> Abscissa:
        """The angle, folded into one period."""
        period = 2 * np.pi / self.shape["periods"]
        return Abscissa("angle within a period", "rad", signals.q[:, self.joints[0]], period)

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂q_j = N sgn v (w_s cos − w_c sin); ∂/∂v_j = slope of sgn v · (w_c cos + w_s sin)."""
        j, n = self.joints[0], self.shape["periods"]
        angle, v = n * signals.q[:, j], signals.v[:, j]
        cos, sin, w = np.cos(angle), np.sin(angle), weights[:, 0]
        by_q = n * smooth_sign(v) * (w[:, 1] * cos - w[:, 0] * sin)
        by_v = smooth_sign_slope(v) * (w[:, 0] * cos + w[:, 1] * sin)
        return Cotangents(q=signals.only(j, by_q), v=signals.only(j, by_v))
