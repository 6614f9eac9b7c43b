"""A drive that follows position set points, as those of quadrupeds and servos do.

    τ = clip(k_p (q* − q_enc) + k_d (v* − v), ±τ_max)

at every control step, held until the next. Set points q* are the planned motion at the instants of
the command's clock (multiples of 1/f from t = 0), each held until the next one; one that is sent at
t acts from t + d on. q_enc is what the encoder counts, v the joint's speed. v* is 0, as most such
drives have it, or the planned speed at the same instants.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.torque_sources.command import DriveLaw
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.leading import LeadingSetPoints, Moves
from excite_cli.simulation.planned_motion import Planned

LONGEST_DELAY = 1.0  # s
_ROUNDING = 1e-6  # of a period of the command's clock


@dataclass(frozen=True)
class PositionDrive:
    """Gains `kp` (n,) [N·m/rad] and `kd` (n,) [N·m·s/rad] (N/m, N·s/m), and the command's way.

    `command_rate` [Hz] of the set points, `delay` [s] until one acts; with `set_point_speeds` they
    have speeds, too. `limit` (n,) [N·m] (N) of the torque, empty: none. With `lead`, set points
    lead the motion by what drives lag behind (`leading.py`).
    """

    kp: tuple[float, ...]
    kd: tuple[float, ...]
    command_rate: float = 500.0
    delay: float = 0.0
    set_point_speeds: bool = False
    limit: tuple[float, ...] = ()
    lead: bool = False

    @classmethod
    def of_law(cls, law: DriveLaw, set_point_speeds: bool, lead: bool = False) -> "PositionDrive":
        """The drive with the gains, limit and delay of a law."""
        limit = tuple(law.limit) if np.isfinite(law.limit).any() else ()
        gains = tuple(law.kp), tuple(law.kd)
        return cls(
            *gains, delay=law.delay, set_point_speeds=set_point_speeds, limit=limit, lead=lead
        )

    def limits(self, others: Array) -> Array:
        """Torques (n,) at which it stops, `others` (n,) those of the motors; infinite: none."""
        return np.minimum(others, self.limit) if self.limit else others

    def sent_for(self, motion: Planned, robot: Robot) -> "Planned | LeadingSetPoints":
        """What set points are taken from, so that `robot` plays `motion`."""
        if not self.lead:
            return motion
        free = np.full(robot.n, np.inf)
        law = DriveLaw(np.array(self.kp), np.array(self.kd), self.limits(free), self.delay)
        step = 1.0 / self.command_rate
        return LeadingSetPoints(motion, robot, law, step, self.set_point_speeds)

    def __post_init__(self) -> None:
        """Raise ConfigError for what no drive has."""
        if not all(0.0 < gain < math.inf for gain in self.kp):
            raise ConfigError("--kp: gains must be above 0, or the drive follows nothing.")
        if not all(0.0 <= gain < math.inf for gain in self.kd):
            raise ConfigError("--kd: gains must not be negative.")
        if not 0.0 < self.command_rate < math.inf:
            raise ConfigError(f"--command-rate {self.command_rate:g}: give a rate above 0 Hz.")
        if not 0.0 <= self.delay <= LONGEST_DELAY:
            raise ConfigError(
                f"--command-delay {self.delay:g}: allowed: 0 to {LONGEST_DELAY:g} s, from sending "
                "a set point until it acts."
            )

    def sent(self, t: Array) -> Array:
        """When the newest set point at the instants `t` (T,) was sent [s]."""
        return np.floor(t * self.command_rate + _ROUNDING) / self.command_rate

    def set_points(self, motion: Moves, t: Array) -> tuple[Array, Array]:
        """Positions and speeds (T, n) of the newest set points sent by the instants `t` (T,)."""
        q, v, _ = motion.states(self.sent(t))
        return q, v if self.set_point_speeds else np.zeros_like(q)

    def recorded(self, motion: Moves, t: Array) -> dict[str, Array]:
        """Channels of the log: set points as they are sent, whenever they act."""
        q, v = self.set_points(motion, t)
        return {"q_cmd": q, "v_cmd": v} if self.set_point_speeds else {"q_cmd": q}

    def record(self, joint_names: Sequence[str], limit: Array | None) -> dict[str, Any]:
        """As plain data; `limit` (n,) of the torque where the drive has one."""

        def named(values: Sequence[float] | Array) -> dict[str, float]:
            return dict(zip(joint_names, map(float, values), strict=True))

        return {
            "kp": named(self.kp),
            "kd": named(self.kd),
            "delay": self.delay,
            "command_rate": self.command_rate,
            "set_point_speeds": self.set_point_speeds,
            "limit": None if limit is None else named(limit),
            "lead": self.lead,
        }


def parse_gains(option: str, texts: Sequence[str], joint_names: Sequence[str]) -> tuple[float, ...]:
    """Gains (n,) of `option` from its values, each NUMBER for all joints or JOINT=NUMBER for one.

    Raises
    ------
    ConfigError
        A text is neither, names another joint, or a joint is left without a gain.
    """
    every: float | None = None
    own: dict[str, float] = {}
    for text in texts:
        joint, equals, number = (part.strip() for part in text.rpartition("="))
        if not equals:
            every = _gain(option, text, number)
        elif joint in joint_names:
            own[joint] = _gain(option, text, number)
        else:
            raise ConfigError(
                f"{option} {text}: there is no joint '{joint}'.{nearest(joint, joint_names)} "
                f"Joints: {', '.join(joint_names)}."
            )
    return _of_joints(option, every, own, joint_names)


def _gain(option: str, text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError(
            f"{option} {text}: '{number}' is not a finite number. Give one number for all joints, "
            f"or JOINT=NUMBER, as often as there are joints with a gain of their own."
        )
    return value


def _of_joints(
    option: str, every: float | None, own: Mapping[str, float], joint_names: Sequence[str]
) -> tuple[float, ...]:
    left = [name for name in joint_names if every is None and name not in own]
    if left:
        raise ConfigError(
            f"{option}: no gain for {', '.join(left)}. Give one number for all joints, or "
            f"{option} {left[0]}=NUMBER for each of them."
        )
    return tuple(own.get(name, every if every is not None else 0.0) for name in joint_names)
