"""What a YAML file may say about wrenches that hold the robot, and about how its base moves."""

from typing import Literal

from pydantic import Field, model_validator

from excite_cli.config.section import Section, Vector3


class WrenchSpec(Section):
    """A sensor of force and moment between the robot and what it stands on."""

    channel: str = Field(
        "wrench",
        description="name in the files of fx, fy, fz [N], mx, my, mz [N·m]: a dataset (samples, "
        "6), columns <channel>_fx …, or a topic of WrenchStamped",
    )
    link: str | None = Field(
        None, description="link that it acts on; default: the root of the robot"
    )
    frame: Literal["link", "world"] = Field(
        "link",
        description="axes and reference point of the wrench: those of the link (a foot or base "
        "sensor), or fixed in the world (a force plate)",
    )
    position: Vector3 = Field(
        (0.0, 0.0, 0.0),
        description="reference point in that frame [m]; of the world the origin is the root of "
        "the robot at robot.posture",
    )
    rotation: Vector3 = Field(
        (0.0, 0.0, 0.0), description="roll, pitch, yaw of the sensor's axes in that frame [rad]"
    )
    acts_on: Literal["robot", "sensor"] = Field(
        "robot", description="sensor: the file holds what the robot does to the sensor, −w"
    )


class ImuSpec(Section):
    """An inertial measurement unit on the base."""

    link: str | None = Field(
        None, description="link whose axes and origin are those of the unit; default: the root"
    )
    gyroscope: str = Field(
        "gyroscope",
        description="channel of ωx, ωy, ωz [rad/s]: a dataset (samples, 3), columns <channel>_x …, "
        "or a topic of Imu",
    )
    accelerometer: str = Field(
        "accelerometer",
        description="channel of the specific force ax, ay, az [m/s²], 9.81 at rest. The name of "
        "the gyroscope where one topic, or one dataset (samples, 6), columns <channel>_wx … "
        "<channel>_az, has both",
    )


class BaseStateSpec(Section):
    """How the base moved; where nothing is given, it stood still at its reference."""

    pose: str | None = Field(
        None,
        description="channel of an estimator's x, y, z [m], qx, qy, qz, qw of the root of the "
        "robot, or a topic of PoseStamped or Odometry; the origin is taken from its mean",
    )
    imu: ImuSpec | None = Field(
        None, description="taken where no pose is: the base sways about its reference"
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> "BaseStateSpec":
        if self.pose is not None and self.imu is not None:
            raise ValueError("give pose or imu, not both: the base moves as one of them says")
        return self
