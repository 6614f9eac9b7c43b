"""The typed problem: what a YAML file may say, with units, defaults and limits.

Every model is frozen and refuses unknown keys. Units: rad (m for prismatic joints), s, N·m (N),
kg, m. The JSON Schema that `excite schema` prints is made from these classes.
"""

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StrictBool, Tag, field_validator, model_validator

from excite_cli.config.data_spec import (
    DiagnosisSpec,
    EffectSpec,
    IdentificationSpec,
    MeasurementSpec,
)
from excite_cli.config.section import (
    Duration,
    Finite,
    Frequency,
    Integer,
    NonNegative,
    Positive,
    Power,
    Samples,
    Section,
    Share,
    Vector3,
)


class JointLimits(Section):
    """Limits of one joint that replace those of the URDF."""

    position: tuple[Finite, Finite] | None = Field(None, description="lower, upper [rad or m]")
    velocity: Positive | None = Field(None, description="largest speed [rad/s or m/s]")
    acceleration: Positive | None = Field(None, description="largest acceleration [rad/s²]")
    effort: Positive | None = Field(None, description="largest torque [N·m or N]")

    @field_validator("position")
    @classmethod
    def _ordered(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and value[0] >= value[1]:
            raise ValueError(f"the lower limit {value[0]:g} is not below the upper {value[1]:g}")
        return value


class RobotSpec(Section):
    """Which robot, which of its joints move, and where the others stand."""

    urdf: str = Field(description="path relative to this file, or example-robot-data:<name>")
    package_dirs: tuple[str, ...] = Field(
        (), description="folders in which package:// names of the URDF are looked up"
    )
    joints: Literal["all"] | tuple[str, ...] = Field("all", description="moved joints")
    posture: dict[str, Finite] = Field(
        default_factory=dict,
        description="joint values [rad or m] at which unmoved joints are locked and motions start",
    )
    base: Literal["fixed", "floating"] = "fixed"
    base_orientation: tuple[Finite, Finite, Finite] = Field(
        (0.0, 0.0, 0.0), description="roll, pitch, yaw of the base [rad]"
    )
    rows: tuple[Literal["joints", "base"], ...] = Field(
        ("joints",), description="measured rows: joint torques, the wrench at the base, or both"
    )
    gravity: Vector3 = Field((0.0, 0.0, -9.81), description="[m/s²] in the world frame")
    limits: dict[str, JointLimits] = Field(default_factory=dict)

    @field_validator("joints")
    @classmethod
    def _some_joints(cls, value: Any) -> Any:
        if value != "all":
            if not value:
                raise ValueError("name at least one joint, or write 'all'")
            twice = sorted({j for j in value if list(value).count(j) > 1})
            if twice:
                raise ValueError(f"named twice: {', '.join(twice)}")
        return value

    @model_validator(mode="after")
    def _rows_fit_base(self) -> "RobotSpec":
        if not self.rows or len(set(self.rows)) != len(self.rows):
            raise ValueError("rows must name 'joints', 'base' or both, each once")
        if "base" in self.rows and self.base == "fixed":
            raise ValueError("rows: 'base' needs base: floating (a fixed base has no wrench row)")
        return self


class FourierSpec(Section):
    """Fourier series of Eq. 50."""

    family: Literal["fourier"] = "fourier"
    harmonics: Integer = Field(5, ge=1, le=100, description="N")
    base_frequency: Frequency = Field(0.785398, description="ω [rad/s]")
    at_rest: StrictBool = Field(False, description="no velocity or acceleration at start and end")

    @model_validator(mode="after")
    def _enough_harmonics(self) -> "FourierSpec":
        if self.at_rest and self.harmonics < 3:
            raise ValueError("at_rest needs at least 3 harmonics")
        return self


class BSplineSpec(Section):
    """Clamped B-spline."""

    family: Literal["bspline"]
    duration: Duration = Field(description="[s]")
    control_points: Integer = Field(12, ge=4, le=500)
    degree: Integer = Field(5, ge=3, le=9)
    at_rest: StrictBool = Field(True, description="no velocity or acceleration at start and end")

    @model_validator(mode="after")
    def _enough_points(self) -> "BSplineSpec":
        needed = self.degree + 1 + (4 if self.at_rest else 0)
        if self.control_points < needed:
            raise ValueError(f"degree {self.degree} needs at least {needed} control points")
        return self


def _kind_by(key: str, default: str) -> Callable[[Any], Any]:
    """Tells which kind of section is meant: what stands under `key`, else `default`."""

    def kind(value: Any) -> Any:
        if isinstance(value, dict):
            return value.get(key, default)
        return getattr(value, key, default)

    return kind


TrajectorySpec = Annotated[
    Annotated[FourierSpec, Tag("fourier")] | Annotated[BSplineSpec, Tag("bspline")],
    Discriminator(_kind_by("family", "fourier")),
]


class GridSpec(Section):
    """Equidistant instants from the start; what is not given follows from the trajectory."""

    samples: Samples | None = Field(None, description="default: see sampling")
    step: Positive | None = Field(None, description="[s]; default: duration / samples")


class SamplingSpec(Section):
    """Instants at which cost and constraints are evaluated.

    By default they cover the whole trajectory: the cost with 40 samples (or two per coefficient),
    the constraints every 0.02 s (at least 100, at most 1000 samples).
    """

    cost: GridSpec = GridSpec()
    constraints: GridSpec = GridSpec()


CriterionKind = Literal[
    "condition_number",
    "smooth_condition_number",
    "log_det",
    "sigma_min",
    "trace_inverse",
    "condition_and_sigma_min",
]


class CriterionSpec(Section):
    """What is minimised, and how rows and columns of the regressor are weighted."""

    kind: CriterionKind = "condition_number"
    smoothing: Power = Field(64.0, description="p of the smooth condition number")
    row_weights: Literal["none", "effort"] | dict[str, Positive] = Field(
        "none", description="1/effort limit, or one weight per joint (1/torque noise)"
    )
    column_scaling: Literal["none", "unit_norm", "a_priori"] = "none"


class JointLimitsSpec(Section):
    """Bounds on joint position, velocity and acceleration."""

    position: StrictBool = True
    velocity: StrictBool | Positive = Field(
        True, description="URDF limit, or [rad/s] for every joint"
    )
    acceleration: Positive | None = Field(None, description="[rad/s²] for every joint")
    scale: Share = Field(1.0, description="share of velocity limits")
    position_margin: NonNegative = Field(0.0, description="kept from position limits [rad or m]")


class TorqueSpec(Section):
    """Bound on the torque predicted with the URDF's inertias."""

    scale: Share = Field(1.0, description="share of the effort limit")


class DiscSpec(Section):
    """Centre of mass within a disc on the ground plane (Eq. 52)."""

    kind: Literal["disc"] = "disc"
    radius: Positive = Field(description="[m]")
    center: Literal["posture"] | tuple[Finite, Finite] = Field(
        "posture", description="world x, y [m]; 'posture': where the posture puts it"
    )


class PolygonSpec(Section):
    """Centre of mass within a convex support polygon."""

    kind: Literal["polygon"]
    vertices: tuple[tuple[Finite, Finite], ...] = Field(description="world x, y [m], any order")
    margin: NonNegative = Field(0.0, description="[m] kept from every edge")

    @field_validator("vertices")
    @classmethod
    def _triangle(cls, value: Any) -> Any:
        if len(value) < 3:
            raise ValueError("a polygon needs at least 3 vertices")
        return value


BalanceSpec = Annotated[
    Annotated[DiscSpec, Tag("disc")] | Annotated[PolygonSpec, Tag("polygon")],
    Discriminator(_kind_by("kind", "disc")),
]


class CapsuleSpec(Section):
    """A capsule given by hand, in the frame of its joint (see `excite robots`)."""

    start: Vector3
    end: Vector3
    radius: Positive


class SelfCollisionSpec(Section):
    """Distances between capsules (Eq. 53)."""

    capsules: Literal["auto"] | dict[str, CapsuleSpec] = Field(
        "auto", description="fitted to the URDF, with those named here (by link) replaced"
    )
    margin: NonNegative = Field(0.01, description="distance kept [m]")
    ignore: tuple[tuple[str, str], ...] = Field((), description="pairs of links not to check")


class ConstraintsSpec(Section):
    """What a motion must keep; a part that is absent or null is not checked."""

    joint_limits: JointLimitsSpec | None = JointLimitsSpec()
    torque: TorqueSpec | None = None
    balance: BalanceSpec | None = None
    self_collision: SelfCollisionSpec | None = None


class OptimizerSpec(Section):
    """How the motion is sought."""

    method: Literal["interior_point", "sqp", "slsqp"] = "interior_point"
    qp_solver: Literal["daqp", "piqp"] = Field("daqp", description="used by method: sqp")
    max_seconds: Positive = Field(30.0, description="per start of a motion")
    max_iterations: Integer = Field(400, ge=1, le=100_000)
    restarts: Integer = Field(1, ge=1, le=100, description="starts tried per motion, the best kept")
    tolerance: Positive = Field(
        1e-3, description="change of the (logarithmic) criterion over 8 iterations that ends a run"
    )


class SequenceSpec(Section):
    """Motions generated one after the other."""

    motions: Integer = Field(1, ge=1, le=1000)


class Spec(Section):
    """A whole problem."""

    robot: RobotSpec
    trajectory: TrajectorySpec = FourierSpec()
    sampling: SamplingSpec = SamplingSpec()
    criterion: CriterionSpec = CriterionSpec()
    constraints: ConstraintsSpec = ConstraintsSpec()
    optimizer: OptimizerSpec = OptimizerSpec()
    effects: tuple[EffectSpec, ...] | None = Field(
        None, description="the declared model; default: the friction of the URDF's <dynamics>"
    )
    measurement: MeasurementSpec = MeasurementSpec()
    identification: IdentificationSpec = IdentificationSpec()
    diagnosis: DiagnosisSpec = DiagnosisSpec()
    sequence: SequenceSpec = SequenceSpec()
    seed: Integer = Field(1, ge=0, le=2**32 - 1)
