"""What a YAML file may say of the work that a model is identified for."""

from typing import Literal

from pydantic import Field, model_validator

from excite_cli.config.section import Finite, Positive, Section, Share


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
