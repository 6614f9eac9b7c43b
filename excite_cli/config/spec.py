"""The typed problem: what a YAML file may say, with units, defaults and limits.

Every model is frozen and refuses unknown keys. Units: rad (m for prismatic joints), s, N·m (N),
kg, m. The JSON Schema that `excite schema` prints is made from these classes.
"""

from typing import ClassVar, Literal

from pydantic import Field, StrictBool

from excite_cli.config.constraints_spec import ConstraintsSpec
from excite_cli.config.data_spec import (
    DiagnosisSpec,
    EffectKind,
    EffectSpec,
    IdentificationSpec,
    MeasurementSpec,
    RunStates,
)
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.section import (
    Finite,
    Integer,
    Motions,
    NonNegative,
    Positive,
    Power,
    Section,
    Share,
)
from excite_cli.config.trajectory_spec import FourierSpec, SamplingSpec, TaskSpec, TrajectorySpec
from excite_cli.shown.answer import Shown

# What a YAML file may say about how well the inertias are known before identification.


class BodyUncertaintySpec(Section):
    """Bounds on mass, centre of mass and inertia of a body, around those of the URDF.

    The mass is m₀(1 ± mass), the centre c₀ ± center_of_mass along each axis, and the inertia about
    the centre of mass I_kl ± inertia·(I_kk + I_ll)/2. All such bodies are within the box of the ten
    parameters about the joint frame for which limits are kept.
    """

    mass: NonNegative = Field(0.1, description="share of the mass")
    center_of_mass: NonNegative = Field(0.01, description="[m] along each axis")
    inertia: NonNegative = Field(
        0.1, description="share of the moments of inertia about the centre"
    )


class UncertaintySpec(BodyUncertaintySpec):
    """Torque, balance and contact hold for every inertia within these bounds."""

    bodies: dict[str, BodyUncertaintySpec] = Field(
        default_factory=dict, description="other bounds for bodies, by the joint that moves them"
    )
    fit: str | None = Field(
        None,
        description="fit file of `excite identify`: its covariance bounds what it identified",
    )
    sigmas: Positive = Field(3.0, description="half axes of its ellipsoid, in standard deviations")


# What a YAML file may say of numbers that were identified: the model that `excite score` plays.


class IdentifiedEffectSpec(Section):
    """An effect with its values."""

    kind: EffectKind = Field(description="one of the effects")
    joints: tuple[str, ...] = Field(description="names of the joints that it acts on")
    shape: dict[str, Finite] = Field(
        default_factory=dict, description="values of its non-linear parameters"
    )
    runs: tuple[str, ...] = Field((), description="runs that had it; empty: it is always there")
    covariate: str = Field("", description="the column of the log that it follows, if any")
    values: tuple[Finite, ...] = Field(description="its linear parameters in order")


class IdentifiedSpec(Section):
    """A model with its numbers, as `excite diagnose --apply` writes it; a fit looks at none."""

    gone: ClassVar = {"sealed_run": ((None, ""), "is called held_out_run since version 0.3")}

    inertias: dict[str, Finite] = Field(
        description="ten parameters of every body about its joint's frame, as m[elbow]"
    )
    effects: tuple[IdentifiedEffectSpec, ...] = Field((), description="effects with their values")
    held_out_run: str = Field("", description="the run whose errors these are")
    error: dict[str, dict[str, float | None]] = Field(
        default_factory=dict,
        description="errors when it was made, by figure (relative, relative_moving, rms, "
        "rms_moving) and joint",
    )
    noise: dict[str, Finite] = Field(
        default_factory=dict, description="noise of the filtered torque by joint, where known"
    )
    processing: dict[str, float | str | None] = Field(
        default_factory=dict, description="the filters that these errors belong to"
    )


class CriterionSpec(Section):
    """What is minimised, and how rows and columns of the regressor are weighted."""

    kind: str = Field(
        "condition_number",
        description="function of the singular values; see docs/criteria.md",
        json_schema_extra={"x-family": "criteria"},
    )
    smoothing: Power = Field(64.0, description="p of the smooth condition number")
    row_weights: Literal["none", "effort"] | dict[str, Positive] = Field(
        "none", description="1/effort limit, or one weight per joint (1/torque noise)"
    )
    column_scaling: Literal["none", "unit_norm", "a_priori"] = Field(
        "none",
        description="unit_norm: columns of a fixed random stack get length 1; a_priori: columns "
        "times the URDF's parameters",
    )
    of: Literal["robot", "load"] = Field(
        "robot",
        description="load: the ten parameters of what the robot carries, itself being known; see "
        "`excite optimize --for payload`",
    )
    load_link: str | None = Field(
        None, description="link that carries the load, of: load; default: the last one"
    )


class OptimizerSpec(Section):
    """How the motion is sought."""

    gone: ClassVar = {
        "method": (
            ("interior_point",),
            "there is one method now, the interior point, which was the best of them; leave this "
            "key out",
        ),
        "qp_solver": (("daqp", "piqp"), "no quadratic program is solved any more; leave it out"),
    }

    max_seconds: Positive = Field(30.0, description="per start of a motion")
    max_iterations: Integer = Field(1000, ge=1, le=100_000, description="per start of a motion")
    restarts: Integer | None = Field(
        None,
        ge=1,
        le=10_000,
        description="starts per motion, the best kept; half of them continue after three stages of "
        "the search, a quarter of those after four, the first one to the end; default: 4, with "
        "predicted_torque, whose starts end alike, 1",
    )
    tolerance: Positive | None = Field(
        None,
        description="change of the (logarithmic) criterion over 8 iterations that ends a run; "
        "default: 1e-3, with predicted_torque 3e-3",
    )
    certify: StrictBool = Field(
        True, description="prove the constraints between the instants; false: 1 kHz samples only"
    )


class UntilSpec(Section):
    """What ends a sequence: every precision that is given is reached, or the time is spent.

    Precision is that of all data, earlier ones (`--prior`) included. No figure depends on which
    columns are called base parameters. With `predicted_deviation` or `power`, and without
    `sequence.motions`, motions are also as short as they may be: no longer than `trajectory` says.
    """

    predicted_deviation: Positive | None = Field(
        None,
        description="standard deviation of torques predicted for the task (RMS), in units of the "
        "noise of one sample, effects being unknown, too: what `excite optimize` prints",
    )
    power: dict[str, Positive] = Field(
        default_factory=dict,
        description="sizes of effects, {kind: size of its first parameter}, that a diagnosis of "
        "the motions would name on every joint",
    )
    probability: Share = Field(0.95, lt=1, description="with which it would name those of `power`")
    torque_deviation: Positive | None = Field(
        None,
        description="standard deviation of torques predicted at random states within the limits "
        "(RMS), in units of the noise of one sample",
    )
    efficiency: Share | None = Field(
        None,
        description="information efficiency relative to D-optimal free states",
    )
    duration: Positive | None = Field(
        None, description="[s] of all motions; none begins that would exceed it"
    )

    @property
    def precise(self) -> bool:
        """Whether a precision is asked for."""
        return (
            self.counts_seconds or self.torque_deviation is not None or self.efficiency is not None
        )

    @property
    def counts_seconds(self) -> bool:
        """Whether what is asked for grows with the seconds of motion, not with instants alone."""
        return self.predicted_deviation is not None or bool(self.power)


class SequenceSpec(Section):
    """Motions generated one after the other."""

    motions: Motions | None = Field(
        None,
        description="how many, each on top of all earlier ones; with `until`: at most; default: 1, "
        "with `until` 20, as short as what is asked for allows",
    )
    until: UntilSpec | None = Field(None, description="ends the sequence earlier")


class Spec(Shown, Section):
    """A whole problem."""

    robot: RobotSpec
    trajectory: TrajectorySpec = FourierSpec()
    sampling: SamplingSpec = SamplingSpec()
    criterion: CriterionSpec = CriterionSpec()
    task: TaskSpec = TaskSpec()
    constraints: ConstraintsSpec = ConstraintsSpec()
    uncertainty: UncertaintySpec | None = None
    optimizer: OptimizerSpec = OptimizerSpec()
    effects: tuple[EffectSpec, ...] | None = Field(
        None, description="the declared model; default: the friction of the URDF's <dynamics>"
    )
    runs: dict[str, RunStates] = Field(
        default_factory=dict,
        description="what differs between runs, {run: {kind of effect: state}}, as {monday_3: "
        "{payload: tool_2kg}}; runs of one state share its effect, `none` is without",
    )
    identified: IdentifiedSpec | None = Field(
        None, description="the model with its numbers, as `excite diagnose --apply` writes it"
    )
    measurement: MeasurementSpec = MeasurementSpec()
    identification: IdentificationSpec = IdentificationSpec()
    diagnosis: DiagnosisSpec = DiagnosisSpec()
    sequence: SequenceSpec = SequenceSpec()
    seed: Integer = Field(1, ge=0, le=2**32 - 1, description="of all random numbers")
