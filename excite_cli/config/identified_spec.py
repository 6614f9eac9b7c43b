"""What a YAML file may say of numbers that were identified: the model that `excite score` plays."""

from typing import ClassVar

from pydantic import Field

from excite_cli.config.section import Finite, Section


class IdentifiedEffectSpec(Section):
    """An effect with its values."""

    kind: str = Field(description="one of the effects")
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
