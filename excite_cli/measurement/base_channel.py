"""Channels of a log that belong to no joint: wrenches that hold the robot, how its base moves."""

from dataclasses import dataclass
from enum import Enum, auto

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.wrench_spec import BaseStateSpec, ImuSpec, WrenchSpec


class SensorKind(Enum):
    """What such a channel holds."""

    WRENCH = auto()
    GYROSCOPE = auto()
    ACCELEROMETER = auto()
    IMU = auto()  # both
    POSE = auto()


_PARTS = {
    SensorKind.WRENCH: ("fx", "fy", "fz", "mx", "my", "mz"),
    SensorKind.GYROSCOPE: ("x", "y", "z"),
    SensorKind.ACCELEROMETER: ("x", "y", "z"),
    SensorKind.IMU: ("wx", "wy", "wz", "ax", "ay", "az"),
    SensorKind.POSE: ("x", "y", "z", "qx", "qy", "qz", "qw"),
}


@dataclass(frozen=True)
class BaseChannel:
    """A channel as it is `declared` at `where` in the config: a topic of a bag.

    `name` is what it is called elsewhere: `left/wrench` is no name of an HDF5 dataset.
    """

    declared: str
    kind: SensorKind
    where: str

    @property
    def name(self) -> str:
        """`left_wrench` of a topic `/left/wrench`."""
        return self.declared.strip("/").replace("/", "_")

    @property
    def parts(self) -> tuple[str, ...]:
        """What its columns are, in order."""
        return _PARTS[self.kind]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of its columns, where each stands by itself."""
        return tuple(f"{self.name}_{part}" for part in self.parts)

    def holds(self, column: str) -> bool:
        """Whether a column of a file, or an array of several, is of this channel."""
        return column == self.name or column in self.columns


def of_wrench(spec: WrenchSpec) -> BaseChannel:
    """Where a sensor's wrench is."""
    return BaseChannel(spec.channel, SensorKind.WRENCH, "measurement.wrench")


def of_imu(spec: ImuSpec) -> tuple[BaseChannel, ...]:
    """Where rates and specific forces are, in this order; one channel may hold both."""
    where = "measurement.base.imu"
    rates = BaseChannel(spec.gyroscope, SensorKind.GYROSCOPE, f"{where}.gyroscope")
    forces = BaseChannel(spec.accelerometer, SensorKind.ACCELEROMETER, f"{where}.accelerometer")
    if rates.name == forces.name:
        return (BaseChannel(spec.gyroscope, SensorKind.IMU, where),)
    return rates, forces


def of_base_state(spec: BaseStateSpec) -> tuple[BaseChannel, ...]:
    """Where the pose of the base is, or the readings of its unit; nothing where it stood still."""
    if spec.pose is not None:
        return (BaseChannel(spec.pose, SensorKind.POSE, "measurement.base.pose"),)
    return () if spec.imu is None else of_imu(spec.imu)


def channels_of_base(spec: MeasurementSpec) -> tuple[BaseChannel, ...]:
    """All channels of the base and of what holds it."""
    return (*map(of_wrench, spec.wrench), *of_base_state(spec.base))
