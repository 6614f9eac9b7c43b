"""Friction between two joints whose gears are coupled, as in the wrists of many arms.

The coupled shaft turns with w = v_j + s v_k, s = ±1. Its friction f_v w + f_c sgn w loads joint j
as it is and joint k times s:

    τ_j = f_v s v_k + f_c sgn(v_j + s v_k)
    τ_k = f_v s v_j + f_c s sgn(v_j + s v_k)

The shares f_v v_j of row j and f_v v_k of row k are left to the joints' own viscous friction. With
s = 1 this is how the Stäubli TX40 is written. Where a second shaft turns with v_j − s v_k, as in a
differential, what shows of f_v is the difference of the two: it may be negative, and either part
may be missing.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Scope, Signals
from excite_cli.effects.mechanism import MjcfParts, Tendon, real
from excite_cli.effects.sign import smooth_sign, smooth_sign_slope
from excite_cli.effects.simulated_robot import DryCoupling, SimulatedRobot
from excite_cli.robot.model import Array, Robot

_USUAL_SPEED = 0.25  # rad/s, at which a shaft's two parts are weighed: joints are slow at reversals


class CoupledFriction(Effect):
    """Friction on v_j + s v_k in the rows of both joints, without their own viscous shares."""

    kind: ClassVar = "coupled_friction"
    title: ClassVar = "friction of coupled gears"
    signature: ClassVar = "a joint's residual follows the speed of its neighbour, and the reverse"
    function_of: ClassVar = ("speed",)
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (
        Parameter("viscous", "N·m·s/rad", 0.1, 100.0),
        Parameter("coulomb", "N·m", 0.05, 300.0, nonnegative=True, part_of_torque=True),
    )
    shapes: ClassVar = (Parameter("direction", "1", -1.0, 1.0),)
    defaults: ClassVar[Mapping[str, float]] = {"direction": 1.0}
    prior_cost: ClassVar = 3.0
    refines: ClassVar = ("viscous_friction", "coulomb_friction")
    varies: ClassVar = ("viscous_friction",)
    usual: ClassVar = True

    @classmethod
    def grid(cls, robot: Robot, joints: tuple[int, ...], signals: Sequence[Signals]) -> list[dict]:
        """The joints turn the shaft the same way, or against each other."""
        return [{"direction": 1.0}, {"direction": -1.0}]

    def possible(self, values: Array) -> bool:
        """A negative viscous part that outweighs the dry one belongs to the other direction."""
        viscous, coulomb = values
        return super().possible(values) and bool(viscous * _USUAL_SPEED >= -coulomb)

    def taken(self, values: Array) -> tuple[float, Array]:
        """|f_v|: the shaft's own share is part of the viscous friction of either joint."""
        return float(abs(values[0])), np.array([np.sign(values[0]), 0.0])

    @property
    def completes(self) -> bool:
        """Small friction of a joint of its own would be taken for that of the shaft."""
        return True

    def finer_steps(self, name: str, signals: Sequence[Signals]) -> Sequence[float]:
        """None: a direction is 1 or −1."""
        return ()

    def coupled_speeds(self) -> tuple[tuple[int, int, float], ...]:
        """The shaft's: while it sticks, so does its friction."""
        first, second = self.joints
        return ((first, second, float(self.shape["direction"])),)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """The dry part is a tendon's friction; the viscous one has no such part in MuJoCo."""
        robot.tell_controller(self, values)
        first, second = self.joints
        if numbers["coulomb"] > 0.0:
            direction = 1.0 if numbers["direction"] > 0 else -1.0
            robot.couplings.append(DryCoupling(first, second, direction, numbers["coulomb"]))
        viscous = values * np.array([1.0, 0.0])
        if viscous.any():
            robot.apply(self, viscous)

    def columns(self, signals: Signals) -> Array:
        """(T, 2, 2): rows j and k, parameters viscous and coulomb."""
        v, s = signals.v[:, list(self.joints)], self.shape["direction"]
        sign = smooth_sign(v[:, 0] + s * v[:, 1])
        viscous = s * v[:, ::-1]
        coulomb = np.stack([sign, s * sign], axis=-1)
        return np.stack([viscous, coulomb], axis=-1)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """Both rows of both parts."""
        (j, k), (viscous, coulomb) = self.joints, values
        way = self.shape["direction"]
        shaft = f"{real(coulomb)} * SIGN(v[{j}] + {real(way)} * v[{k}])"
        return (
            f"{{ const real shaft = {shaft}; "
            f"tau[{j}] += {real(viscous * way)} * v[{k}] + shaft; "
            f"tau[{k}] += {real(viscous * way)} * v[{j}] + {real(way)} * shaft; }}"
        )

    def abscissa(self, signals: Signals) -> Abscissa:
        """The speed of the shaft that both joints turn."""
        first, second = self.joints
        shaft = signals.v[:, first] + self.shape["direction"] * signals.v[:, second]
        return Abscissa("speed of the coupled shaft", "rad/s", shaft)

    def put_into_mjcf(self, parts: MjcfParts, values: Array) -> bool:
        """Friction and damping of a tendon; its damping is the joints' own less, too."""
        (first, second), (viscous, coulomb) = self.joints, map(float, values)
        if coulomb < 0.0 or viscous < 0.0:
            return False
        parts.tendons.append(Tendon(first, second, self.shape["direction"], coulomb, viscous))
        return True

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """Viscous: the other row's weight times s; Coulomb: both through the slope of the sign."""
        pair, s = list(self.joints), self.shape["direction"]
        v = signals.v[:, pair]
        through = (weights[:, 0, 1] + s * weights[:, 1, 1]) * smooth_sign_slope(v @ [1.0, s])
        back = np.zeros_like(signals.v)
        back[:, pair] = s * weights[:, ::-1, 0] + through[:, None] * [1.0, s]
        return Cotangents(v=back)
