"""What a YAML file may say about the robot."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import radians
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from excite_cli.config.section import Finite, NonNegative, Positive, Section, Vector3
from excite_cli.errors import nearest

# Limits of robots as their makers publish them, by the name that `robot.limits_preset` gives.
#
# Every number is from the source that stands beside it; what a source does not give is left to
# the robot's file. Joints are known by how their names end, so that prefixes do not matter.

_ARM = tuple(rf"(?<!finger_)joint{k}" for k in range(1, 8))
_UR = tuple(
    f"{name}_joint"
    for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
)
_LBR = tuple(rf"(?:joint_?a?|A){k}" for k in range(1, 8))


@dataclass(frozen=True)
class LimitPreset:
    """Limits of one robot; `joints`: patterns of how names end, in the order of the numbers.

    position: lower, upper [rad]; velocity [rad/s]; acceleration [rad/s²]; jerk [rad/s³]; effort
    [N·m]; empty where the source has none.
    """

    title: str
    source: str
    joints: tuple[str, ...]
    position: tuple[tuple[float, float], ...] = ()
    velocity: tuple[float, ...] = ()
    acceleration: tuple[float, ...] = ()
    jerk: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()

    def of_joints(self, names: Sequence[str]) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Joints among `names` that the preset is about, each with its limits by their key."""
        keys = ("position", "velocity", "acceleration", "jerk", "effort")
        for k, ending in enumerate(self.joints):
            given = {key: values[k] for key in keys if (values := getattr(self, key))}
            for name in names:
                if re.search(f"{ending}$", name):
                    yield name, given

    def missing(self, names: Sequence[str]) -> list[str]:
        """Numbers from 1 on of those of its joints that none of `names` is."""
        return [
            str(k)
            for k, ending in enumerate(self.joints, start=1)
            if not any(re.search(f"{ending}$", name) for name in names)
        ]


def _ur(title: str, folder: str, speeds: Sequence[float], effort: Sequence[float]) -> LimitPreset:
    """Speeds in °/s; the file names the user manual and the maker's article on joint torques."""
    source = (
        "https://github.com/UniversalRobots/Universal_Robots_ROS2_Description/blob/rolling/"
        f"config/{folder}/joint_limits.yaml"
    )
    velocity = tuple(radians(speed) for speed in speeds)
    return LimitPreset(title, source, _UR, velocity=velocity, effort=tuple(effort))


_FRANKA = "https://frankarobotics.github.io/docs/robot_specifications.html"

LIMIT_PRESETS: Mapping[str, LimitPreset] = {
    "franka_emika_panda": LimitPreset(
        "Franka Emika Panda (FER)",
        _FRANKA,
        _ARM,
        position=((-2.8973, 2.8973), (-1.7628, 1.7628), (-2.8973, 2.8973), (-3.0718, -0.0698),
                  (-2.8973, 2.8973), (-0.0175, 3.7525), (-2.8973, 2.8973)),
        velocity=(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
        acceleration=(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
        jerk=(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
        effort=(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
    ),
    # Its speed limits depend on position; these are the position and speed limits that the manual
    # suggests for planners of fixed limits.
    "franka_research_3": LimitPreset(
        "Franka Research 3",
        _FRANKA,
        _ARM,
        position=((-2.3093, 2.3093), (-1.5133, 1.5133), (-2.4937, 2.4937), (-2.7478, -0.4461),
                  (-2.48, 2.48), (0.8521, 4.2094), (-2.6895, 2.6895)),
        velocity=(2.0, 1.0, 1.5, 1.25, 3.0, 1.5, 3.0),
        acceleration=(10.0,) * 7,
        jerk=(5000.0,) * 7,
        effort=(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
    ),
    "kuka_lbr_iiwa_14": LimitPreset(
        "KUKA LBR iiwa 14 R820",
        "https://github.com/RobotLocomotion/drake/blob/master/manipulation/models/"
        "iiwa_description/README.md, which quotes page 30 of the maker's brochure",
        _LBR,
        velocity=tuple(radians(speed) for speed in (85, 85, 100, 75, 130, 135, 135)),
        effort=(320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0),
    ),
    "ur3e": _ur("Universal Robots UR3e", "ur3e", (180, 180, 180, 360, 360, 360),
                (56.0, 56.0, 28.0, 12.0, 12.0, 12.0)),
    "ur5e": _ur("Universal Robots UR5e", "ur5e", (180,) * 6, (150.0,) * 3 + (28.0,) * 3),
    "ur10e": _ur("Universal Robots UR10e", "ur10e", (120, 120, 180, 180, 180, 180),
                 (330.0, 330.0, 150.0, 56.0, 56.0, 56.0)),
}  # fmt: skip


PresetName = Annotated[str, Field(json_schema_extra={"enum": [*LIMIT_PRESETS]})]


class JointLimits(Section):
    """Limits of one joint that replace those of the URDF."""

    position: tuple[Finite, Finite] | None = Field(None, description="lower, upper [rad or m]")
    velocity: Positive | None = Field(None, description="largest speed [rad/s or m/s]")
    acceleration: Positive | None = Field(None, description="largest acceleration [rad/s²]")
    jerk: Positive | None = Field(None, description="largest jerk [rad/s³]")
    effort: Positive | None = Field(None, description="largest torque [N·m or N]")
    effort_by_speed: tuple[tuple[NonNegative, NonNegative], ...] | None = Field(
        None,
        description="in place of effort, [speed, torque] points [rad/s, N·m] of the motor's curve, "
        "from speed 0 on, straight lines between them; holds where the motor drives, braking has "
        "the torque of speed 0; beyond the last point the last line goes on",
    )

    @field_validator("position")
    @classmethod
    def _ordered(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and value[0] >= value[1]:
            raise ValueError(f"the lower limit {value[0]:g} is not below the upper {value[1]:g}")
        return value

    @field_validator("effort_by_speed")
    @classmethod
    def _a_curve(cls, value: Any) -> Any:
        if value is None:
            return value
        speeds, efforts = zip(*value, strict=True) if value else ((), ())
        if len(value) < 2:
            raise ValueError("give at least two points; for one torque at all speeds give effort")
        if speeds[0] != 0.0 or efforts[0] == 0.0:
            raise ValueError("the first point must have speed 0 and a torque above 0")
        for k in range(1, len(value)):
            before, here = value[k - 1], value[k]
            if here[0] <= before[0] or here[1] > before[1]:
                raise ValueError(
                    f"[{here[0]:g}, {here[1]:g}] after [{before[0]:g}, {before[1]:g}]: speeds must "
                    "increase and torques must not"
                )
        return value

    @model_validator(mode="after")
    def _one_effort(self) -> "JointLimits":
        if self.effort is not None and self.effort_by_speed is not None:
            raise ValueError("give effort or effort_by_speed, not both")
        return self


class TransmissionSpec(Section):
    """Motors that drive joints together: a differential, belts that run over other joints."""

    joints: tuple[str, ...] = Field(description="moved joints that it drives")
    motors: tuple[str, ...] = Field(description="as many motors, by names of their own")
    matrix: tuple[tuple[Finite, ...], ...] = Field(
        description="joint positions = matrix · motor positions; a row per joint"
    )
    limits: dict[str, JointLimits] = Field(
        default_factory=dict, description="limits of the motors, by name"
    )

    @model_validator(mode="after")
    def _square(self) -> "TransmissionSpec":
        count = len(self.joints)
        if count == 0 or len(self.motors) != count:
            raise ValueError(
                f"{count} joints and {len(self.motors)} motors; there must be as many, at least one"
            )
        if len(self.matrix) != count or any(len(row) != count for row in self.matrix):
            raise ValueError(f"matrix must have {count} rows of {count} numbers, a row per joint")
        for name, own in self.limits.items():
            if name not in self.motors:
                raise ValueError(
                    f"limits: '{name}' is none of its motors ({', '.join(self.motors)})"
                )
            if own.effort_by_speed is not None:
                raise ValueError(
                    f"limits.{name}.effort_by_speed: only for a motor that drives one joint alone; "
                    "give effort, the torque at the highest speed that the motor is to have"
                )
        return self


class PayloadSpec(Section):
    """Something rigid that a link carries: its mass and the capsule that contains it."""

    link: str = Field(description="link that carries it; see `excite robots`")
    mass: NonNegative = Field(0.0, description="[kg]")
    center: Vector3 = Field((0.0, 0.0, 0.0), description="centre of mass in the link [m]")
    inertia: tuple[NonNegative, NonNegative, NonNegative] = Field(
        (0.0, 0.0, 0.0), description="Ixx, Iyy, Izz about the centre of mass, link axes [kg·m²]"
    )
    start: Vector3 = Field(description="one end of the capsule's axis, in the link [m]")
    end: Vector3 = Field(description="the other end [m]")
    radius: Positive = Field(description="of the capsule [m]")


class RobotSpec(Section):
    """Which robot, which of its joints move, and where the others stand."""

    urdf: str = Field(
        description="URDF, xacro, MJCF or SDF: path relative to this file, or "
        "example-robot-data:<name>, or robot_descriptions:<name>"
    )
    xacro_args: dict[str, str | int | float | bool] = Field(
        default_factory=dict, description="arguments of a xacro file, {name: value}"
    )
    package_dirs: tuple[str, ...] = Field(
        (),
        description="folders beyond its own that the robot's files may read: packages, or "
        "folders that hold some",
    )
    density: Positive | None = Field(
        None,
        description="links without mass take mass and inertia of their shapes at this density "
        "[kg/m³]; default: they have none",
    )
    joints: Literal["all"] | tuple[str, ...] = Field("all", description="moved joints")
    posture: dict[str, Finite] = Field(
        default_factory=dict,
        description="joint values [rad or m] at which unmoved joints are locked and motions start",
    )
    base: Literal["fixed", "floating"] = Field(
        "fixed", description="floating: the base stands still and its wrench can be measured"
    )
    base_orientation: tuple[Finite, Finite, Finite] = Field(
        (0.0, 0.0, 0.0), description="roll, pitch, yaw of the base [rad]"
    )
    rows: tuple[Literal["joints", "base"], ...] = Field(
        ("joints",), description="measured rows: joint torques, the wrench at the base, or both"
    )
    gravity: Vector3 = Field((0.0, 0.0, -9.81), description="[m/s²] in the world frame")
    limits: dict[str, JointLimits] = Field(default_factory=dict)
    limits_preset: PresetName | None = Field(
        None,
        description="limits of a robot's manual in place of the URDF's, where `limits` gives none",
    )
    transmissions: tuple[TransmissionSpec, ...] = Field(
        (), description="motors that drive several joints together"
    )
    payload: PayloadSpec | None = None

    @field_validator("joints")
    @classmethod
    def _some_joints(cls, value: Any) -> Any:
        if value != "all":
            if not value:
                raise ValueError("name at least one joint, or write 'all'")
            twice = sorted(j for j, count in Counter(value).items() if count > 1)
            if twice:
                raise ValueError(f"named twice: {', '.join(twice)}")
        return value

    @field_validator("limits_preset")
    @classmethod
    def _known_preset(cls, value: str | None) -> str | None:
        if value is not None and value not in LIMIT_PRESETS:
            known = ", ".join(LIMIT_PRESETS)
            raise ValueError(
                f"there is no '{value}'.{nearest(value, LIMIT_PRESETS)} There are {known}"
            )
        return value

    @model_validator(mode="after")
    def _rows_fit_base(self) -> "RobotSpec":
        if not self.rows or len(set(self.rows)) != len(self.rows):
            raise ValueError("rows must name 'joints', 'base' or both, each once")
        if "base" in self.rows and self.base == "fixed":
            raise ValueError("rows: 'base' needs base: floating (a fixed base has no wrench row)")
        return self
