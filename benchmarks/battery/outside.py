"""Effects that no name of the catalogue fits, to be planted only.

All of them are dissipative, conservative or a fault of the sensor, as real ones are; whatever a
diagnosis calls them is wrong.
"""

from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Effect, Parameter, Scope, Signals
from excite_cli.effects.sign import smooth_sign
from excite_cli.robot.model import Array, Robot


class RubbingSector(Effect):
    """τ_j = f exp(−(q_j − c)²/2w²) sgn v_j: a seal or a cable that rubs in one sector."""

    kind: ClassVar = "outside:rubbing_sector"
    title: ClassVar = "friction in one sector"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("friction", "N·m", 0.05, 300.0, nonnegative=True),)
    shapes: ClassVar = (Parameter("centre", "rad", 0.1, 3.0), Parameter("width", "rad", 0.1, 1.0))

    def columns(self, signals: Signals) -> Array:
        j = list(self.joints)
        away = (signals.q[:, j, None] - self.shape["centre"]) / self.shape["width"]
        return np.exp(-0.5 * away**2) * smooth_sign(signals.v[:, j, None])


class DistantCoupling(Effect):
    """τ_j = c v_k and τ_k = c v_j of joints that are no neighbours.

    With as much viscous friction of their own, which is declared, it only takes energy away.
    """

    kind: ClassVar = "outside:distant_coupling"
    title: ClassVar = "viscous coupling of joints that are no neighbours"
    signature: ClassVar = ""
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (Parameter("viscous", "N·m·s/rad", 0.01, 100.0),)

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        return [(j, k) for j in range(robot.n) for k in range(j + 2, robot.n)]

    def columns(self, signals: Signals) -> Array:
        first, second = self.joints
        return np.stack([signals.v[:, second], signals.v[:, first]], axis=1)[:, :, None]


class HardeningSpring(Effect):
    """τ_j = k (q_j − q_0)³."""

    kind: ClassVar = "outside:hardening_spring"
    title: ClassVar = "spring that hardens"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("stiffness", "N·m/rad³", 0.01, 2000.0, nonnegative=True),)
    shapes: ClassVar = (Parameter("rest", "rad", 0.1, 3.0),)

    def columns(self, signals: Signals) -> Array:
        return (signals.q[:, list(self.joints), None] - self.shape["rest"]) ** 3


class TorqueHysteresis(Effect):
    """The sensor remembers: z' = τ'/w (1 − z sgn τ'), h z is added to the torque τ it shows."""

    kind: ClassVar = "outside:torque_hysteresis"
    title: ClassVar = "hysteresis of the torque sensor"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("height", "N·m", 0.01, 100.0, nonnegative=True),)
    shapes: ClassVar = (Parameter("width", "N·m", 0.1, 100.0),)
    data_defect: ClassVar = True

    def columns(self, signals: Signals) -> Array:
        torque = signals.torque[:, self.joints[0]]
        z = np.zeros(len(torque))
        for t, change in enumerate(np.diff(torque), start=1):
            # Exact over a step of constant direction, so it stays within ±1.
            side = np.sign(change)
            z[t] = side + (z[t - 1] - side) * np.exp(-abs(change) / self.shape["width"])
        return z[:, None, None]


OUTSIDE: tuple[type[Effect], ...] = (
    RubbingSector,
    DistantCoupling,
    HardeningSpring,
    TorqueHysteresis,
)
