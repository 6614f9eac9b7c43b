"""The simulated drive that follows set points (`position_drive`), as the controller of a run.

Who reads the log takes the drive's law for the torque. Where that is wrong by a gain g or an offset
b (effects of the data), the joint gets (τ − b)/(1 + g).
"""

from typing import ClassVar

import numpy as np

from excite_cli.errors import ConfigError
from excite_cli.robot.model import Array
from excite_cli.simulation.build import Build
from excite_cli.simulation.leading import Moves
from excite_cli.simulation.position_drive import PositionDrive


class SetPointControl:
    """The drive of one run's robot, step by step at `t` (N,): a `Controller`.

    `encoder`: its step [rad] (m).

    Raises
    ------
    ConfigError
        The robot has effects of a measured torque, which is not there.
    """

    advice: ClassVar = (
        "Take smaller gains (--kp, --kd), or limit the torque (--torque-limits): at "
        "{rate:g} steps per second a drive holds a light joint only with small gains."
    )

    def __init__(
        self, drive: PositionDrive, build: Build, motion: Moves, t: Array, encoder: float
    ) -> None:
        if build.recorded or build.delay.any() or np.isfinite(build.reading).all(axis=1).any():
            raise ConfigError(
                "--control position: this robot measures no torque, so that effects of a "
                "measured torque have no place in it (torque_delay, torque_saturation, "
                "covariate_offset, …). A command acts late by --command-delay; a motor saturates "
                "by --torque-limits, or torque_saturation with actuator:1."
            )
        self._kp, self._kd = np.array(drive.kp), np.array(drive.kd)
        self._q, self._v = drive.set_points(motion, t - drive.delay)
        self._build, self._encoder = build, encoder

    def torque(self, k: int, q: Array, v: Array) -> Array:
        """Torque (n,) from control step `k` to the next, in the state q, v (n,)."""
        build = self._build
        read = q + build.position_offset
        if self._encoder > 0.0:
            read = np.round(read / self._encoder) * self._encoder
        torque = self._kp * (self._q[k] - read) + self._kd * (self._v[k] - v)
        torque = np.clip(torque, -build.clip, build.clip)
        return np.asarray((torque - build.offset) / (1.0 + build.gain))
