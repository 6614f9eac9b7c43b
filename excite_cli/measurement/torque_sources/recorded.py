"""Torques that were recorded: of a sensor at the link, of the motor, or the motor's current."""

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.dataset import Array, Run
from excite_cli.measurement.torque_sources.base import TorqueSource, per_joint

NEWTON_METERS = {"Nm": 1.0, "mNm": 1e-3, "Ncm": 1e-2, "kNm": 1e3, "kgfcm": 0.0980665}


def torque_units(spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
    """N·m (N) in one unit of the file, (n,)."""
    unit = spec.torque_unit
    return per_joint(NEWTON_METERS[unit] if isinstance(unit, str) else unit, joints)


class Link(TorqueSource):
    """Behind the gear, by a sensor or as an estimate of the drive."""

    name = "link"
    title = "at the joint"

    def torque(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """As recorded, in N·m and with its sign."""
        return run.tau * per_joint(spec.sign, joints) * torque_units(spec, joints)


class Motor(Link):
    """Before the gear."""

    name = "motor"
    title = "of the motor, before the gear"
    at_motor = True
    scaled_by = "gear_ratio"


class Current(Motor):
    """Of the motor: torque is its constant times that."""

    name = "current"
    title = "the motor's current"
    scaled_by = "torque_constant and gear_ratio"

    def torque(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """k_t i."""
        return super().torque(run, spec, joints) * per_joint(spec.torque_constant, joints)
