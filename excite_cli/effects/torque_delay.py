"""Torque that is recorded late: τ_measured(t) = τ(t − δ) ≈ τ − δ dτ/dt, but for jumps.

One delay for all joints of the effect, of all terms of the torque: a lag of friction alone is not
a delay. It is looked for on all joints together, on those of an arm, and on single ones.
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.arrays import Mask
from excite_cli.effects.base import Abscissa, Cotangents, Effect, Parameter, Scope, Signals
from excite_cli.effects.judgement import Seen
from excite_cli.effects.mechanism import real
from excite_cli.effects.simulated_robot import SimulatedRobot
from excite_cli.robot.link_frame import branches
from excite_cli.robot.model import Array, Robot

_MISSED = 3e-3  # of the delay, one standard deviation; measured on simulated arms
_SHORTEST_ALONE = 1.5e-3  # s
# Less is no delay of anybody's: a simulator that integrates in steps of 1 ms shows −0.2 ms, which
# was named beside a ripple of 20 to 35 % of the torque.
_SHORTEST = 3e-4  # s


class TorqueDelay(Effect):
    """Row j of every joint named: −δ d(torque_j)/dt with one δ, zero where joint j turns back."""

    kind: ClassVar = "torque_delay"
    over_time: ClassVar = True
    title: ClassVar = "delay of the measured torque"
    signature: ClassVar = "the residual is the torque's rate of change, on all joints alike"
    function_of: ClassVar = ("load",)
    scope: ClassVar[Scope] = "robot"
    parameters: ClassVar = (
        Parameter(
            "delay", "s", 5e-4, 0.1, believed=(-0.1, 0.1),
            because="no controller closes its loop with more than 0.1 s",
        ),
    )  # fmt: skip
    data_defect: ClassVar = True
    of_sensor: ClassVar = True

    @classmethod
    def places(cls, robot: Robot) -> list[tuple[int, ...]]:
        """All joints together, those of every arm, then each on its own."""
        every = tuple(range(robot.n))
        arms = [arm for arm in branches(robot) if 1 < len(arm) < robot.n]
        return [every, *arms, *((j,) for j in every if robot.n > 1)]

    def possible(self, values: Array) -> bool:
        """Of one joint alone, less than a moment is friction that lags a little."""
        alone = len(self.joints) == 1
        return super().possible(values) and not (alone and values[0] < _SHORTEST_ALONE)

    def absurd(self, values: Array, seen: Seen) -> str:
        """Nor is what is shorter than any clock is true to."""
        if abs(values[0]) < _SHORTEST:
            return f"a delay of {1e3 * values[0]:.2g} ms is less than time stamps are true to"
        return super().absurd(values, seen)

    def model_error(self, values: Array) -> Array:
        """What the second order makes of it."""
        return _MISSED * np.abs(values)

    def columns(self, signals: Signals) -> Array:
        """−d(torque)/dt, (T, len(joints), 1); zero where a joint turns back."""
        rate = signals.rate(signals.torque[:, list(self.joints)])
        return -np.where(self._turns(signals), 0.0, rate)[:, :, None]

    def _turns(self, signals: Signals) -> Mask:
        """Instants (T, joints) between two of which the speed changes sign.

        Dry friction jumps there, and again and again where a joint stands. A jump has no rate: of a
        UR3's wrists 5.3 % of the torque was left with it, 1.9 without any delay.
        """
        back = np.signbit(signals.v[:, list(self.joints)])
        found = np.zeros(back.shape, bool)
        changes = back[1:] != back[:-1]
        found[1:] |= changes
        found[:-1] |= changes
        return found

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """−δ d(torque_j)/dt; its rate is zero where the joint turns back."""
        late = real(-float(values[0]))
        return " ".join(f"tau[{j}] += {late} * torque_rate[{j}];" for j in self.joints)

    def abscissa(self, signals: Signals) -> Abscissa | None:
        """The rate of the torque; of several joints each has its own, so None."""
        if len(self.joints) != 1:
            return None
        rate = signals.rate(signals.torque[:, self.joints[0]])
        return Abscissa("rate of the torque", "N·m/s", rate)

    def build_into(
        self, robot: SimulatedRobot, values: Array, numbers: Mapping[str, float]
    ) -> None:
        """Torque is recorded as it was that long ago."""
        robot.delay[list(self.joints)] += values[0]

    def pull_back(self, signals: Signals, weights: Array) -> Cotangents:
        """∂/∂torque = −(transpose of the rate) weight."""
        back = np.zeros_like(signals.torque)
        counted = np.where(self._turns(signals), 0.0, weights[:, :, 0])
        back[:, list(self.joints)] = -signals.rate_back(counted)
        return Cotangents(torque=back)
