"""All sources of torque by the name that `measurement.torque` gives them."""

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.torque_sources.base import TorqueSource
from excite_cli.registry import Registry

TORQUE_SOURCES: Registry[TorqueSource] = Registry(
    "source of torque",
    "excite.torque_sources",
    TorqueSource,
    {
        "link": "recorded:Link",
        "motor": "recorded:Motor",
        "current": "recorded:Current",
        "command": "command:Command",
        "voltage": "voltage:Voltage",
        "duty": "voltage:Duty",
    },
    ("name", "title"),
)


def torque_source(spec: MeasurementSpec) -> TorqueSource:
    """The source that `measurement.torque` names.

    Raises
    ------
    ConfigError
        There is none of that name.
    """
    return TORQUE_SOURCES.named(spec.torque, "measurement.torque")()
