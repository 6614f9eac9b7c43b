"""Part of one joint's torque in another's: crosstalk of sensors, or gears that nobody uncoupled.

τ_j,measured = τ_j + c τ_k. Channels of strain gauges leak into each other, and where the motor of
one axis carries some of the next one's load (coupled wrists, a parallelogram), a torque that was
computed from its current has that load in it.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Scope, Signals, Tier
from excite_cli.effects.mechanism import real
from excite_cli.robot.model import Array, Robot


class TorqueCrosstalk(Effect):
    """The first joint's torque grows by c · (torque of the second)."""

    kind: ClassVar = "torque_crosstalk"
    title: ClassVar = "part of the second joint's torque in the first's"
    signature: ClassVar = "a joint's residual has the shape of another joint's torque"
    scope: ClassVar[Scope] = "pair"
    parameters: ClassVar = (
        Parameter(
            "share", "1", 0.005, 0.3, believed=(-0.5, 0.5),
            because="half of another joint's torque is a swapped column or a transmission",
        ),
    )  # fmt: skip
    data_defect: ClassVar = True
    of_sensor: ClassVar = True
    prior_cost: ClassVar = 6.0
    tier: ClassVar = Tier.LAST

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """Ordered pairs of joints of one chain: in the first one's torque that of the second."""
        above: list[set[int]] = []
        for parent in robot.parents:
            above.append({parent, *above[parent]} if parent >= 0 else set())
        joints = range(robot.base_joints, robot.n)
        return [(j, k) for j in joints for k in joints if j in above[k] or k in above[j]]

    def rows(self, n: int) -> tuple[int, ...]:
        """The first joint's."""
        return self.joints[:1]

    def columns(self, signals: Signals) -> Array:
        """torque_k, (T, 1, 1)."""
        return signals.torque[:, self.joints[1:], None]

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """c torque_k."""
        j, k = self.joints
        return f"tau[{j}] += {real(values[0])} * torque[{k}];"

    def abscissa(self, signals: Signals) -> Abscissa:
        """Torque of the other joint."""
        return Abscissa("torque of the other joint", "N·m", signals.torque[:, self.joints[1]])

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂torque_k = weight."""
        torque = np.zeros_like(signals.q)
        torque[:, self.joints[1]] = weights[:, 0, 0]
        return Cotangents(torque=torque)
