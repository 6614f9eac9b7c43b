"""How a motion is played and recorded."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from excite_cli.errors import ConfigError
from excite_cli.simulation.covariate_series import CovariateSeries
from excite_cli.simulation.position_drive import PositionDrive

MOST_REPEATED = 10_000
_MOST_SAMPLES = 20_000_000
_NOISES = ("force_noise", "moment_noise", "acceleration_noise", "rate_noise")


@dataclass(frozen=True)
class SimulationSettings:
    """Robot, controller and instruments; rates in Hz, `step` and `lead_in` in s.

    `torque_noise`: standard deviation as a share of the joint's torque RMS in that run, with the
    correlation `noise_correlation` from sample to sample. `encoder`: rad (m) a count.
    `inertia_error`: how far the true inertias are from the URDF. `repeat`: takes of each motion,
    `periods` of it in each; `pause` [s] between recordings, which then have absolute stamps.
    `bandwidth` of the controller [rad/s], `compensation`: the share of friction and springs that it
    knows. `torque_limits`: the motors stop at the robot's effort limits. `covariates`: further
    columns of the log, which effects may follow. `force_noise` [N] and `moment_noise` [N·m] are
    those of measured wrenches, `acceleration_noise` [m/s²] and `rate_noise` [rad/s] of the base's
    inertial unit.
    """

    seed: int = 1
    rate: float = 500.0
    torque_noise: float = 0.01
    noise_correlation: float = 0.0
    encoder: float = 2e-5
    inertia_error: float = 0.2
    repeat: int = 1
    periods: int = 1
    pause: float = 0.0
    control_rate: float = 1000.0
    step: float = 5e-4
    bandwidth: float = 100.0
    compensation: float = 0.8
    lead_in: float = 1.0
    torque_limits: bool = False
    covariates: tuple[CovariateSeries, ...] = ()
    force_noise: float = 2.0
    moment_noise: float = 0.5
    acceleration_noise: float = 0.02
    rate_noise: float = 1e-3
    drive: PositionDrive | None = None

    @property
    def physics_step(self) -> float:
        """`step`, or the next smaller one of which a control period is a multiple [s].

        A fourth of it for a drive that follows set points: the engine's positions answer half a
        step early, which in the law is a delay, and kp times it damping (with steps of 0.5 ms
        delays were found 0.2 to 0.4 ms too small).
        """
        period = 1.0 / self.control_rate
        step = self.step if self.drive is None else 0.25 * self.step
        return period / np.ceil(period / step - 1e-9)

    def require_room(self, durations: Iterable[float]) -> None:
        """See that the recordings of motions of these durations [s] can be held in memory.

        Raises
        ------
        ConfigError
            They have more than twenty million instants.
        """
        longest = max(self.rate, self.control_rate)
        samples = longest * self.periods * sum(durations)
        if samples > _MOST_SAMPLES or self.repeat * samples > _MOST_SAMPLES:
            raise ConfigError(
                f"repeat {self.repeat:,}, periods {self.periods:,}: that is "
                f"{self.repeat * samples:.3g} instants; up to {_MOST_SAMPLES:,} are played. Take "
                "fewer, or shorter motions."
            )

    def __post_init__(self) -> None:
        """Raise ConfigError for what cannot be."""
        if not 1.0 <= self.rate <= self.control_rate:
            raise ConfigError(
                f"rate: {self.rate:g} Hz cannot be recorded; allowed: 1 to the controller's rate, "
                f"{self.control_rate:g} Hz."
            )
        if not -1.0 < self.noise_correlation < 1.0:
            raise ConfigError(
                f"noise correlation: {self.noise_correlation:g} is not between -1 and 1."
            )
        if not 0.0 <= self.inertia_error <= 0.6:
            raise ConfigError(
                f"inertia error: {self.inertia_error:g} is not between 0 and 0.6; 0.2 makes "
                "inertias 10 to 30 % larger or smaller."
            )
        for name in ("torque_noise", "encoder", "pause", *_NOISES):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"{name.replace('_', ' ')}: it must not be negative.")
        for name in ("repeat", "periods"):
            if not 1 <= getattr(self, name) <= MOST_REPEATED:
                raise ConfigError(
                    f"{name}: {getattr(self, name)} cannot be played; allowed: 1 to "
                    f"{MOST_REPEATED:,}."
                )
        if self.drive is not None and self.drive.command_rate > self.control_rate:
            raise ConfigError(
                f"--command-rate {self.drive.command_rate:g}: allowed: up to the drive's own rate, "
                f"{self.control_rate:g} Hz."
            )
        for name in ("step", "bandwidth", "lead_in", "control_rate"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"{name.replace('_', ' ')}: it must be positive.")
