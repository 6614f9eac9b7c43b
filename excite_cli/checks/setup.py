"""How a robot is set up: what the columns of its file are, and how it is mounted."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from excite_cli.checks.samples import Samples
from excite_cli.robot.model import Array, Robot

Order = NDArray[np.intp]


@dataclass(frozen=True)
class Setup:
    """Column `order[j]` of the file, times `sign[j]`, is that of joint j; all (n,).

    `gravity` (3,) [m/s²] in the frame in which the config has it, `zero` [rad] added to positions,
    `unit`: N·m in one of the file, `turn`: rad in what the config takes for one, where joints turn.
    `clock`: true seconds in one of the stamps. `lag` [s] of the torque behind the positions.
    `weightless`: a controller took the weight off the torque. `loaded`: last bodies with a tool or
    a load on them.
    """

    gravity: Array
    zero: Array
    q_order: Order
    q_sign: Array
    tau_order: Order
    tau_sign: Array
    unit: Array
    turn: Array
    clock: float = 1.0
    lag: float = 0.0
    weightless: bool = False
    loaded: tuple[int, ...] = ()

    @classmethod
    def as_declared(cls, robot: Robot) -> "Setup":
        """As the config has it."""
        n, ones = robot.n, np.ones(robot.n)
        gravity = np.array(robot.model.gravity.linear)
        return cls(gravity, np.zeros(n), np.arange(n), ones, np.arange(n), ones, ones, ones)

    def motion(self, samples: Samples) -> tuple[Array, Array, Array]:
        """q, v, a (T, n) of the joints."""
        q, v, a = (x[:, self.q_order] * self.q_sign for x in (samples.q, samples.v, samples.a))
        unit = np.where(samples.turns, self.turn, 1.0)
        return unit * q + self.zero, unit * v / self.clock, unit * a / self.clock**2

    def torque(self, samples: Samples) -> Array:
        """τ (T, n) [N·m] of the joints."""
        tau = samples.torque(self.lag) if self.lag else samples.tau
        return np.asarray(tau[:, self.tau_order] * self.tau_sign * self.unit)

    def exchanged(self, positions: Order | None = None, torques: Order | None = None) -> "Setup":
        """With columns exchanged once more; zeros stay with their joints."""
        found = self
        if positions is not None:
            own = {"q_order": self.q_order[positions], "q_sign": self.q_sign[positions]}
            found = replace(found, turn=self.turn[positions], **own)  # type: ignore[arg-type]
        if torques is not None:
            own = {"tau_order": self.tau_order[torques], "tau_sign": self.tau_sign[torques]}
            found = replace(found, unit=self.unit[torques], **own)  # type: ignore[arg-type]
        return found

    def turned(self, name: str, j: int) -> "Setup":
        """With the other sign of `q_sign` or `tau_sign` of joint j."""
        sign = getattr(self, name).copy()
        sign[j] = -sign[j]
        return replace(self, **{name: sign})

    def from_zero(self, j: int, zero: float) -> "Setup":
        """With another zero of joint j [rad]."""
        zeros = self.zero.copy()
        zeros[j] = zero
        return replace(self, zero=zeros)
