"""Motors without a current loop: what a voltage makes of them (hobby servos, BLDC).

    τ = k_t (V − k_e ω) / R        of the motor, with V the supply's voltage times the duty cycle,

k_t [N·m/A] (`measurement.torque_constant`), k_e [V·s/rad] (as large as k_t where nothing is said),
R [Ω], and the motor's speed ω, the joint's times its gear ratio.
"""

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array, Run
from excite_cli.measurement.torque_sources.base import TorqueSource, per_joint, speeds_of


class Voltage(TorqueSource):
    """The voltage at the motor."""

    name = "voltage"
    title = "the motor's voltage"
    channels = ("voltage",)
    at_motor = True
    scaled_by = "torque_constant, motor.resistance and gear_ratio"

    def torque(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """k_t (V − k_e ω) / R."""
        constant = per_joint(spec.torque_constant, joints)
        back = per_joint(spec.motor.back_emf, joints, np.nan)
        back = np.where(np.isnan(back), constant, back)
        speed = speeds_of(run) * per_joint(spec.gear_ratio, joints)
        resistance = per_joint(spec.motor.resistance, joints)
        return constant * (self.voltage(run, spec, joints) - back * speed) / resistance

    def voltage(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """V (T, n) at the motors, with the sign that turns the joint forwards."""
        return run.extra[self.channels[0]] * per_joint(spec.sign, joints)


class Duty(Voltage):
    """The duty cycle, -1 to 1, of a supply whose voltage is known or a column."""

    name = "duty"
    title = "the duty cycle of the motor's voltage"
    channels = ("duty",)

    def voltage(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """Duty cycle times the supply's voltage."""
        supply = spec.motor.supply
        if isinstance(supply, str):
            if supply not in run.extra or run.extra[supply].ndim != 1:
                raise ConfigError(
                    f"measurement.motor.supply: run '{run.name}' has no column '{supply}'."
                    f"{nearest(supply, run.extra)} It has: {listed(sorted(run.extra))}. Name the "
                    "column that holds the supply's voltage [V], or give the number."
                )
            return super().voltage(run, spec, joints) * run.extra[supply][:, None]
        return super().voltage(run, spec, joints) * supply
