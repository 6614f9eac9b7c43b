"""What a YAML file may say about how well the inertias are known before identification."""

from pydantic import Field

from excite_cli.config.section import NonNegative, Positive, Section


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
