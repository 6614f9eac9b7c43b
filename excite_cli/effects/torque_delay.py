"""Torque that is recorded late: τ_measured(t) = τ(t − δ) ≈ τ − δ dτ/dt, but for jumps.

One delay for all joints of the effect, of all terms of the torque: a lag of friction alone is not
a delay. It is looked for on all joints together, on those of an arm, and on single ones.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

import numpy as np

from excite_cli.arrays import Indices
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
    """Row j of every joint named: −δ d(torque_j)/dt with one δ, without the jumps of friction."""

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
        """−d(torque)/dt, (T, len(joints), 1); across instants where a joint turns, a line."""
        rate = signals.rate(signals.torque[:, list(self.joints)])
        for k, (left, right, share) in enumerate(self._across(signals)):
            rate[:, k] = (1.0 - share) * rate[left, k] + share * rate[right, k]
        return -rate[:, :, None]

    def _across(self, signals: Signals) -> Iterator[tuple[Indices, Indices, Array]]:
        """Of each joint, instants (T,) before and after, and the way (T,) from one to the other.

        Where the speed changes sign dry friction jumps, again and again where a joint stands. A
        jump has no rate: of a UR3's wrists 5.3 % of the torque was left with it, 1.9 without any
        delay. Elsewhere both are the instant itself.
        """
        for v in signals.v[:, list(self.joints)].T:
            changes = np.signbit(v[1:]) != np.signbit(v[:-1])
            turns = np.append(changes, False) | np.append(False, changes)
            at = np.arange(len(v))
            kept = at[~turns] if not turns.all() else at
            place = np.searchsorted(kept, at)
            right = kept[np.minimum(place, len(kept) - 1)]
            left = np.where(right == at, right, kept[np.maximum(place - 1, 0)])
            left = np.minimum(left, right)
            share = (at - left) / np.maximum(right - left, 1)
            yield left, right, np.where(right > left, share, 0.0)

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        """−δ d(torque_j)/dt; across instants where the joint turns back, a line."""
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
        onto = np.zeros_like(weights[:, :, 0])
        for k, (left, right, share) in enumerate(self._across(signals)):
            np.add.at(onto[:, k], left, (1.0 - share) * weights[:, k, 0])
            np.add.at(onto[:, k], right, share * weights[:, k, 0])
        back[:, list(self.joints)] = -signals.rate_back(onto)
        return Cotangents(torque=back)
