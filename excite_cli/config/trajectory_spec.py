"""What a YAML file may say about trajectories, their instants, and the work of a model."""

from typing import Annotated, Literal

from pydantic import Discriminator, Field, StrictBool, Tag, model_validator

from excite_cli.config.section import (
    ControlPoints,
    Duration,
    Finite,
    Frequency,
    Harmonics,
    Integer,
    Positive,
    Samples,
    Section,
    Share,
    kind_by,
)

Posture = Literal["posture"] | dict[str, Finite]


class FourierSpec(Section):
    """Fourier series of Eq. 50."""

    family: Literal["fourier"] = Field("fourier", description="periodic")
    harmonics: Harmonics | None = Field(
        None,
        description="N; default: up to 1.5 Hz as far as accelerations allow, at most 12, fewer "
        "where many joints move",
    )
    base_frequency: Frequency = Field(0.785398, description="ω [rad/s]")
    at_rest: StrictBool = Field(False, description="no velocity or acceleration at start and end")
    start: Posture | None = Field(
        None,
        description="where the motion starts and ends [rad or m], `posture`: at robot.posture; "
        "joints not named are at robot.posture; needs at_rest",
    )

    @model_validator(mode="after")
    def _enough_harmonics(self) -> "FourierSpec":
        if self.at_rest and self.harmonics is not None and self.harmonics < 3:
            raise ValueError("at_rest needs at least 3 harmonics")
        if self.start is not None and not self.at_rest:
            raise ValueError("start needs at_rest: true")
        return self


class BSplineSpec(Section):
    """Clamped B-spline."""

    family: Literal["bspline"] = Field(description="from a start to an end")
    duration: Duration = Field(description="[s]")
    control_points: ControlPoints | None = Field(
        None, description="per joint; default: as many as harmonics would be free"
    )
    degree: Integer = Field(5, ge=3, le=9, description="of its polynomial pieces")
    at_rest: StrictBool = Field(True, description="no velocity or acceleration at start and end")
    start: Posture | None = Field(
        None,
        description="where the motion starts [rad or m], `posture`: at robot.posture; joints not "
        "named are at robot.posture; needs at_rest",
    )
    end: Posture | None = Field(None, description="where it ends; as start")

    @model_validator(mode="after")
    def _enough_points(self) -> "BSplineSpec":
        needed = self.degree + 1 + (4 if self.at_rest else 0)
        if self.control_points is not None and self.control_points < needed:
            raise ValueError(f"degree {self.degree} needs at least {needed} control points")
        if (self.start is not None or self.end is not None) and not self.at_rest:
            raise ValueError("start and end need at_rest: true")
        return self


TrajectorySpec = Annotated[
    Annotated[FourierSpec, Tag("fourier")] | Annotated[BSplineSpec, Tag("bspline")],
    Discriminator(kind_by("family", "fourier")),
]


class GridSpec(Section):
    """Equidistant instants from the start; what is not given follows from the trajectory."""

    samples: Samples | None = Field(None, description="default: see sampling")
    step: Positive | None = Field(None, description="[s]; default: duration / samples")


class SamplingSpec(Section):
    """Instants at which cost and constraints are evaluated.

    By default they cover the whole trajectory: the cost with 40 samples (or four per coefficient),
    the constraints every 0.02 s (at least 100, at most 1000 samples).
    """

    cost: GridSpec = GridSpec()
    constraints: GridSpec = GridSpec()


class TaskSpec(Section):
    """Where torques are to be predicted well, and how large noise and missing effects may be."""

    log: str | None = Field(
        None, description="recording of the work (HDF5, CSV, bag …): torques at its states"
    )
    plan: str | None = Field(
        None, description="planned motion of the work (CSV, ROS 2, MoveIt …): torques along it"
    )
    position: dict[str, tuple[Finite, Finite]] = Field(
        default_factory=dict,
        description="[rad, m] ranges of joints that the work uses; others: their limits",
    )
    speed: Share = Field(1.0, description="share of the speed limits that the work uses")
    acceleration: Share = Field(
        1.0, description="share of the acceleration limits that the work uses"
    )
    effects: Literal["auto"] | tuple[str, ...] = Field(
        "auto",
        description="kinds of effects that the robot may have beside the declared ones; auto: all "
        "of the catalogue that act on one joint and need no recording",
    )
    rate: Positive = Field(
        20.0, description="[1/s] independent samples of the torque in a second of motion"
    )

    @model_validator(mode="after")
    def _one_source(self) -> "TaskSpec":
        given = [
            name
            for name, there in (
                ("log", self.log is not None),
                ("plan", self.plan is not None),
                ("position, speed, acceleration", self._of_region),
            )
            if there
        ]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} exclude each other: give one of them")
        return self

    @property
    def _of_region(self) -> bool:
        return bool(self.position) or self.speed < 1.0 or self.acceleration < 1.0
