"""Noise of the sensors of a standing robot: --wrench-noise and --imu-noise."""

import math

from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError


def base_noise(spec: Spec, wrench: str | None, imu: str | None) -> dict[str, float]:
    """Standard deviations by their names in the settings; none of options that are not given.

    Raises
    ------
    ConfigError
        A text is not two numbers, or the config declares no such sensor.
    """
    found: dict[str, float] = {}
    stands = "base" in spec.robot.rows
    if wrench is not None:
        if not stands:
            raise ConfigError(
                "--wrench-noise: no wrench is measured; robot.rows of the config has no 'base'."
            )
        force, moment = _pair("--wrench-noise", wrench, "FORCE,MOMENT [N, N·m]", "2,0.5")
        found |= {"force_noise": force, "moment_noise": moment}
    if imu is not None:
        if not stands or spec.measurement.base.imu is None:
            raise ConfigError(
                "--imu-noise: no inertial unit is declared; it needs measurement.base.imu, and "
                "'base' in robot.rows."
            )
        form = "ACCELERATION,RATE [m/s², rad/s]"
        acceleration, rate = _pair("--imu-noise", imu, form, "0.02,0.001")
        found |= {"acceleration_noise": acceleration, "rate_noise": rate}
    return found


def _pair(option: str, text: str, form: str, example: str) -> tuple[float, float]:
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        first = second = math.nan
    if not (0.0 <= first < math.inf and 0.0 <= second < math.inf):
        raise ConfigError(
            f"{option}: '{text}' is not {form}, two numbers that are not negative; for example "
            f"{option} {example}."
        )
    return first, second
