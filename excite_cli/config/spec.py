"""The typed problem: what a YAML file may say, with units, defaults and limits.

Every model is frozen and refuses unknown keys. Units: rad (m for prismatic joints), s, N·m (N),
kg, m. The JSON Schema that `excite schema` prints is made from these classes.
"""

from typing import ClassVar, Literal

from pydantic import Field, StrictBool

from excite_cli.config.constraints_spec import ConstraintsSpec
from excite_cli.config.data_spec import (
    DiagnosisSpec,
    EffectSpec,
    IdentificationSpec,
    MeasurementSpec,
    RunStates,
)
from excite_cli.config.identified_spec import IdentifiedSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.section import Integer, Motions, Positive, Power, Section, Share
from excite_cli.config.trajectory_spec import FourierSpec, SamplingSpec, TrajectorySpec
from excite_cli.config.uncertainty_spec import UncertaintySpec
from excite_cli.shown.record import Shown

CriterionKind = Literal[
    "condition_number",
    "smooth_condition_number",
    "log_det",
    "sigma_min",
    "trace_inverse",
    "torque_deviation",
    "condition_and_sigma_min",
]


class CriterionSpec(Section):
    """What is minimised, and how rows and columns of the regressor are weighted."""

    kind: CriterionKind | str = Field(
        "condition_number",
        description="function of the singular values; see docs/criteria.md; or the name of one "
        "that was added to the catalogue",
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
    restarts: Integer = Field(
        4,
        ge=1,
        le=10_000,
        description="starts per motion (multi-start with successive halving: half of the starts "
        "continue after three stages of the search, a quarter of those after four)",
    )
    tolerance: Positive = Field(
        1e-3, description="change of the (logarithmic) criterion over 8 iterations that ends a run"
    )
    certify: StrictBool = Field(
        True, description="prove the constraints between the instants; false: 1 kHz samples only"
    )


class UntilSpec(Section):
    """What ends a sequence: every precision that is given is reached, or the time is spent.

    Precision is that of all data, earlier ones (`--prior`) included. Both figures are the same
    whichever columns are called base parameters.
    """

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
        return self.torque_deviation is not None or self.efficiency is not None


class SequenceSpec(Section):
    """Motions generated one after the other."""

    motions: Motions | None = Field(
        None,
        description="how many, each on top of all earlier ones; with `until`: at most; default: 1, "
        "with `until` 20",
    )
    until: UntilSpec | None = Field(None, description="ends the sequence earlier")


class Spec(Shown, Section):
    """A whole problem."""

    robot: RobotSpec
    trajectory: TrajectorySpec = FourierSpec()
    sampling: SamplingSpec = SamplingSpec()
    criterion: CriterionSpec = CriterionSpec()
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
