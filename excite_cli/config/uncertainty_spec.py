"""What a YAML file may say about how well the inertias are known before identification."""

from pydantic import Field

from excite_cli.config.section import NonNegative, Positive, Section


class BodyUncertaintySpec(Section):
    """Bounds on the ten parameters of a body, as a box around those of the URDF.

    With m the mass of the body: |δm| ≤ mass·m, |δ(m c_k)| ≤ m·center_of_mass + mass·|m c_k|, and
    |δI_kl| ≤ inertia·(I_kk + I_ll)/2 about the joint frame.
    """

    mass: NonNegative = Field(0.1, description="share of the mass")
    center_of_mass: NonNegative = Field(0.01, description="[m] along each axis")
    inertia: NonNegative = Field(0.1, description="share of the moments of inertia")


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
