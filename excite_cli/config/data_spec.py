"""What a YAML file may say about measured data: torque, filters, declared effects, diagnosis."""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, StrictBool, field_validator, model_validator

from excite_cli.config.section import (
    Finite,
    Integer,
    NonNegative,
    Positive,
    Section,
    Share,
)
from excite_cli.config.wrench_spec import BaseStateSpec, WrenchSpec

# What the commonest recorders call things: values of `measurement` under one name each.
#
# What the file of a config says itself goes before them.

PRESETS: dict[str, dict[str, Any]] = {
    # Universal Robots, "Real-Time Data Exchange (RTDE) Guide", controller outputs: timestamp [s],
    # actual_q [rad], actual_qd [rad/s], actual_current [A]. record.py of its client library writes
    # a column for each joint, from 0 on, separated by blanks.
    "ur_rtde": {
        "channels": {"t": "timestamp", "q": "actual_q", "dq": "actual_qd", "tau": "actual_current"},
        "torque": "current",
    },
    # ur_robot_driver's hardware interface fills effort with actual_current [A].
    "ur_ros2": {"torque": "current"},
    # libfranka, RobotState: q [rad], dq [rad/s], tau_J [N·m], "measured link-side joint torque
    # sensor signals", unfiltered.
    "franka": {"channels": {"tau": "tau_J"}, "torque": "link"},
    # KUKA.RobotSensorInterface: IPOC counts ms; AIPos are axes' actual positions [deg]; MACur are
    # motor currents.
    "kuka_rsi": {
        "channels": {"t": "IPOC", "q": "AIPos", "tau": "MACur"},
        "time": "ms",
        "angle": "deg",
        "torque": "current",
    },
    # unitree_legged_sdk and unitree_sdk2, MotorState: q [rad], dq [rad/s], tauEst (tau_est) [N·m],
    # estimated at the output from the current.
    "unitree": {"channels": {"tau": "tau_est"}, "torque": "link"},
    # ROBOTIS e-Manual, X series: present position 4096 counts a turn; present current 2.69 mA a
    # count (XM430, XM540); the unit of present velocity is another one.
    "dynamixel": {
        "channels": {"q": "present_position", "dq": None, "tau": "present_current"},
        "angle": 2 * np.pi / 4096,
        "torque": "current",
        "torque_unit": 2.69e-3,
    },
}


def with_preset(values: dict[str, Any]) -> dict[str, Any]:
    """`measurement` with what its preset adds; mappings are joined key by key."""
    preset = PRESETS.get(str(values.get("preset")))
    if preset is None:
        return values
    found = {**preset, **values}
    for key, own in preset.items():
        if isinstance(own, dict) and isinstance(values.get(key), dict):
            found[key] = {**own, **values[key]}
    return found


EffectKind = Annotated[str, Field(json_schema_extra={"x-family": "effects"})]
TorqueSourceName = Annotated[str, Field(json_schema_extra={"x-family": "torque_sources"})]
ChannelName = Literal["t", "q", "dq", "tau", "q_cmd", "v_cmd", "tau_ff", "voltage", "duty"]
CheckName = Annotated[str, Field(json_schema_extra={"x-family": "checks"})]
RunStates = dict[EffectKind, str]  # `none`: without it


class EffectSpec(Section):
    """An effect of the declared model; its parameters are identified with the inertias."""

    kind: EffectKind = Field(description="name in the catalogue of effects")
    joints: Literal["all"] | tuple[str, ...] = Field(
        "all", description="joints it acts on, each on its own; of a pair, exactly two"
    )
    shape: dict[str, Finite] = Field(
        default_factory=dict, description="values of the effect's non-linear parameters"
    )
    runs: Literal["all"] | tuple[str, ...] = Field(
        "all", description="runs it is present in, or stretches of them between gaps (`b/2`)"
    )
    covariate: str = Field(
        "", description="column that it follows, one of measurement.covariates, if its kind does"
    )


PerJoint = Finite | dict[str, Finite]
AngleUnit = Literal["rad", "deg"] | Positive


class FilterSpec(Section):
    """Zero-phase low-pass filters; what is `auto` is chosen from the data and reported."""

    position: Literal["auto", "none"] | Positive = Field(
        "auto", description="cut-off of the positions [Hz]"
    )
    parallel: Literal["auto", "none"] | Positive = Field(
        "auto", description="cut-off of torque and of every regressor column [Hz]"
    )
    rate: Literal["auto"] | Positive = Field(
        "auto", description="rate to which torque and columns are decimated [Hz]"
    )
    border: NonNegative | None = Field(
        None, description="cut at both ends of a run [s]; default: from the cut-offs"
    )
    velocity: Literal["auto", "measured", "differentiated"] = Field(
        "auto", description="auto: differentiated from the filtered positions"
    )


class DriveLawSpec(Section):
    """The law of drives that follow position set points, kp (q* - q) + kd (v* - v) + tau_ff.

    For `torque: command`.
    """

    kp: PerJoint | None = Field(
        None, description="[N·m/rad] at the joint; default: found in the data, by the URDF's masses"
    )
    kd: PerJoint = Field(
        0.0, description="[N·m·s/rad] at the joint; what is not given stays in viscous friction"
    )
    delay: NonNegative | None = Field(
        None, description="[s] after which a set point acts; default: found in the data"
    )
    period: NonNegative = Field(
        1e-3,
        description="[s] of the drive's own loop, whose torque answers positions half of it later, "
        "give or take as much",
    )
    limit: PerJoint | None = Field(
        None,
        description="[N·m] at which the drive's torque stops; motions keep it as they keep effort "
        "limits; default: found in the data",
    )
    set_point_speeds: StrictBool = Field(
        False,
        description="set points have speeds too (v*), for motions that are planned or simulated; a "
        "log shows it by its columns v_cmd",
    )


class MotorSpec(Section):
    """The motor that a voltage turns, for `torque: voltage` and `torque: duty`."""

    resistance: PerJoint = Field(1.0, description="[Ω]")
    back_emf: PerJoint | None = Field(
        None, description="[V·s/rad] of the motor's speed; default: torque_constant"
    )
    supply: Positive | str = Field(
        1.0, description="[V] that a duty cycle of 1 puts on the motor, or the column that holds it"
    )


class MeasurementSpec(Section):
    """What the recorded columns are."""

    gone: ClassVar = {
        "encoder_step": (
            (None,),
            "nothing ever used the resolution of the encoders: the noise is taken from the data; "
            "leave this key out",
        )
    }

    preset: Literal["ur_rtde", "ur_ros2", "franka", "kuka_rsi", "unitree", "dynamixel"] | None = (
        Field(None, description="a recorder whose names and units are known; other keys go before")
    )
    torque: TorqueSourceName = Field(
        "link",
        description="link: at the joint; motor: before the gear; current: before motor and gear; "
        "command: what the drive makes of position set points (columns q_cmd_<joint>); voltage, "
        "duty: what the motor makes of them",
    )
    command: DriveLawSpec = DriveLawSpec()
    motor: MotorSpec = MotorSpec()
    gravity: Literal["included", "subtracted"] = Field(
        "included",
        description="subtracted: from the torque, by a controller; that of the URDF is added again",
    )
    gear_ratio: PerJoint = Field(1.0, description="motor turns per turn of the joint, with sign")
    torque_constant: PerJoint = Field(
        1.0,
        description="[N·m/A] at the motor, for torque: current, voltage and duty; of another unit, "
        "N·m in one of it",
    )
    coupling: dict[str, dict[str, Finite]] = Field(
        default_factory=dict,
        description="further shares of other motors' torques (after their gears) in a joint's "
        "torque, {joint: {motor's joint: share}}",
    )
    sign: dict[str, Literal[-1, 1]] = Field(
        default_factory=dict, description="-1 where the recorded torque has the opposite sign"
    )
    offset: dict[str, Finite] = Field(
        default_factory=dict, description="added to recorded positions [rad or m]"
    )
    position: Literal["link", "motor"] = Field(
        "link", description="motor: divided by gear_ratio, undoing the coupling"
    )
    position_sign: dict[str, Literal[-1, 1]] = Field(
        default_factory=dict, description="-1 where recorded positions have the opposite sign"
    )
    velocity_sign: dict[str, Literal[-1, 1]] = Field(
        default_factory=dict, description="-1 where recorded speeds have the opposite sign"
    )
    time: Literal["s", "ms", "us", "ns", "min", "h"] = Field(
        "s", description="unit of the time stamps"
    )
    clock: Positive = Field(
        1.0, description="true seconds in a second of the time stamps, of a clock that is off"
    )
    torque_unit: Literal["Nm", "mNm", "Ncm", "kNm", "kgfcm"] | PerJoint = Field(
        "Nm",
        description="of recorded torques (forces likewise), or N·m in one unit of the file; with "
        "torque: current, of torque_constant times current",
    )
    torque_lag: Finite = Field(
        0.0, description="time by which recorded torques are late, against positions [s]"
    )
    angle: AngleUnit | dict[str, AngleUnit] = Field(
        "rad",
        description="of positions and speeds of joints that turn; or rad in one unit of the file, "
        "as 0.0015339808 of 4096 counts a turn; or {joint: unit}, others in rad",
    )
    length: Literal["m", "cm", "mm"] = Field(
        "m", description="of positions and speeds of joints that slide"
    )
    rate: Positive | None = Field(
        None, description="[Hz] sampling rate of files that have no column t"
    )
    channels: dict[ChannelName, str | None] = Field(
        default_factory=dict,
        description="names of channels in the file, as {tau: current}; {dq: null} leaves it out",
    )
    names: dict[str, str] = Field(
        default_factory=dict, description="name in the file -> joint of the robot"
    )
    torque_names: dict[str, str] = Field(
        default_factory=dict,
        description="the same of torques alone, where their columns stand in another order",
    )
    covariates: tuple[str, ...] = Field(
        (),
        description="further columns of the files that friction or offsets may follow, as "
        "[temp_j1, ambient]; what belongs to a joint has its name at the end",
    )
    without_torque: tuple[str, ...] = Field(
        (),
        description="joints that move, but whose torque was not recorded or is worth nothing: "
        "only their motion is used",
    )
    wrench: tuple[WrenchSpec, ...] = Field(
        (WrenchSpec(),),
        min_length=1,
        description="sensors between the robot and what it stands on, for robot.rows with 'base': "
        "all that hold it",
    )
    base: BaseStateSpec = Field(BaseStateSpec(), description="how the base moved meanwhile")
    trust: bool | tuple[CheckName, ...] = Field(
        False,
        description="checks of `excite inspect` whose doubts are resolved, as [direction of "
        "gravity]; true: mount, zeros, signs, order, units and clock are as the config says",
    )
    topic: str | None = Field(None, description="topic of a bag; default: the only JointState")
    filter: FilterSpec = FilterSpec()

    @model_validator(mode="before")
    @classmethod
    def _of_a_known_recorder(cls, values: Any) -> Any:
        return with_preset(values) if isinstance(values, dict) else values

    @model_validator(mode="after")
    def _each_channel_once(self) -> "MeasurementSpec":
        names = [sensor.channel for sensor in self.wrench]
        names += [self.base.pose] if self.base.pose else []
        if self.base.imu is not None:  # one channel may hold both
            names += {self.base.imu.gyroscope, self.base.imu.accelerometer}
        for name in names:
            if names.count(name) > 1:
                raise ValueError(
                    f"the channel '{name}' is declared for two sensors of the base: give each its "
                    "own (wrench: channel; base: pose, imu)"
                )
        return self


class KnownPayloadSpec(Section):
    """A payload that was weighed, on some runs: it tells the true scale of the torques."""

    runs: tuple[str, ...] = Field(min_length=1, description="runs in which the robot carries it")
    mass: Positive = Field(description="[kg]")
    std: NonNegative = Field(0.0, description="one standard deviation of the mass [kg]")
    center: tuple[Finite, Finite, Finite] = Field(
        description="centre of mass in the frame of `link` [m]"
    )
    center_std: NonNegative = Field(
        0.003, description="one standard deviation of each of its coordinates [m]"
    )
    inertia: tuple[Finite, Finite, Finite, Finite, Finite, Finite] | None = Field(
        None,
        description="Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the centre, along the axes of `link` "
        "[kg·m²], taken to 10 % of the largest; default: a compact body, to a factor of some two",
    )
    link: str | None = Field(
        None, description="link that carries it; default: that of the last moved joint"
    )


class TotalMassSpec(Section):
    """The weighed robot: it tells the true scale of the wrench at its base."""

    mass: Positive = Field(
        description="of all that the robot consists of and carries in every run [kg]"
    )
    std: NonNegative = Field(0.0, description="one standard deviation of it [kg]")


class IdentificationSpec(Section):
    """How parameters are found."""

    method: Literal["ols", "wls", "irls"] = Field(
        "wls", description="ordinary, weighted by joint, or robust least squares"
    )
    inertias: Literal["auto", "free", "cad"] = Field(
        "auto",
        description="what the URDF's values are worth: auto: one standard deviation is 0.3 of a "
        "value; free: the value itself; cad: `uncertainty` of it. auto and free are wider where "
        "the data show that the URDF is farther off",
    )
    uncertainty: Positive = Field(
        0.1, description="one standard deviation of the URDF's inertial parameters, as a share"
    )
    consistent: bool = Field(True, description="also a physically consistent full set (SDP)")
    gain_std: Positive | None = Field(
        None,
        description="one standard deviation of the gains of the measured torques (torque "
        "constants, gear ratios), as a share: all together, and each beside the others; their "
        "gains are identified, and every uncertainty holds theirs",
    )
    known_payload: KnownPayloadSpec | None = Field(
        None,
        description="a payload of known mass and centre on some runs, which determines the gains",
    )
    total_mass: TotalMassSpec | None = Field(
        None,
        description="the mass of the whole robot, which determines the gains where the wrench at "
        "its base is measured",
    )

    @property
    def needed_runs(self) -> tuple[str, ...]:
        """Runs without which the fit lacks what is known: they are not held out if others are."""
        return self.known_payload.runs if self.known_payload else ()


class DiagnosisSpec(Section):
    """When a candidate becomes a named effect."""

    significance: Share = Field(0.01, description="family-wise error rate")
    gain: NonNegative = Field(
        0.01,
        description="least share by which it lowers the error of cross-validation",
    )
    kinds: Literal["all"] | tuple[EffectKind, ...] = Field(
        "all", description="kinds of effects that are looked for"
    )
    exclude: tuple[EffectKind, ...] = Field((), description="kinds that are not looked for")
    carrying_links: tuple[str, ...] = Field(
        (), description="links that may carry a payload; default: the last of every moved branch"
    )
    moving_speed: Positive | None = Field(
        None, description="a joint moves above this speed [rad/s or m/s]; default 0.02"
    )
    rounds: Integer = Field(
        60, ge=0, le=200, description="largest number of effects that are added"
    )
    block: Positive | None = Field(
        None, description="[s] length of the blocks a single run is cut into"
    )
    max_seconds: Positive | None = Field(
        None, description="[s] after which the search ends with the answer so far"
    )

    @field_validator("kinds")
    @classmethod
    def _some(cls, value: str | tuple[str, ...]) -> str | tuple[str, ...]:
        if value != "all" and not value:
            raise ValueError("name at least one kind, or write 'all'")
        return value
