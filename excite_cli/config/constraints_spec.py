"""What a YAML file may say about the constraints of a motion."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StrictBool, Tag, field_validator, model_validator

from excite_cli.config.section import (
    Finite,
    NonNegative,
    Positive,
    Section,
    Share,
    Vector3,
    kind_by,
)


class JointLimitsSpec(Section):
    """Bounds on joint position, velocity, acceleration and jerk."""

    position: StrictBool = Field(True, description="keep the URDF's position limits")
    velocity: StrictBool | Positive = Field(
        True, description="URDF limit, or [rad/s] for every joint"
    )
    acceleration: Positive | None = Field(None, description="[rad/s²] for every joint")
    jerk: Positive | None = Field(None, description="[rad/s³] for every joint")
    scale: Share = Field(1.0, description="share of velocity limits")
    pace: Share = Field(
        1.0,
        description="share of the limits of velocity, acceleration and jerk: of a first motion, "
        "when little is known of the robot",
    )
    position_margin: NonNegative = Field(0.0, description="kept from position limits [rad or m]")


class TorqueSpec(Section):
    """Bound on the torque predicted with the URDF's inertias."""

    scale: Share = Field(1.0, description="share of the effort limit")


class DiscSpec(Section):
    """Centre of mass within a disc on the ground plane (Eq. 52)."""

    kind: Literal["disc"] = Field("disc", description="the paper's form")
    radius: Positive = Field(description="[m]")
    center: Literal["posture"] | tuple[Finite, Finite] = Field(
        "posture", description="world x, y [m]; 'posture': where the posture puts it"
    )


class PolygonSpec(Section):
    """Centre of mass within a convex support polygon."""

    kind: Literal["polygon"] = Field(description="for feet of any shape")
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
    Discriminator(kind_by("kind", "disc")),
]


class ContactSpec(Section):
    """What the ground can give to a robot that stands on it with all feet.

    The wrench that the motion needs: its zero-moment point within the polygon, no pull, horizontal
    force within a friction pyramid, and moment about the vertical within `torsion` times the load.
    """

    vertices: tuple[tuple[Finite, Finite], ...] | None = Field(
        None, description="support polygon, world x, y [m], any order; none: no bound on the ZMP"
    )
    margin: NonNegative = Field(0.0, description="kept from every edge by the ZMP [m]")
    height: Finite = Field(0.0, description="of the ground in the world frame [m]")
    friction: Positive | None = Field(None, description="coefficient of friction")
    torsion: Positive | None = Field(None, description="moment about the vertical per load [N·m/N]")
    min_load: NonNegative = Field(0.0, description="least vertical force [N]")

    @field_validator("vertices")
    @classmethod
    def _triangle(cls, value: Any) -> Any:
        if value is not None and len(value) < 3:
            raise ValueError("a polygon needs at least 3 vertices")
        return value


class CapsuleSpec(Section):
    """A capsule given by hand, in the frame of its joint (see `excite robots`)."""

    start: Vector3 = Field(description="one end of its axis [m]")
    end: Vector3 = Field(description="the other end [m]")
    radius: Positive = Field(description="[m]")


class SelfCollisionSpec(Section):
    """Distances between capsules (Eq. 53)."""

    capsules: Literal["auto"] | dict[str, CapsuleSpec] = Field(
        "auto", description="fitted to the URDF, with those named here (by link) replaced"
    )
    shapes: Literal["collision", "visual"] = Field(
        "collision",
        description="shapes that represent the links; visual: the visual shapes of links that have "
        "no collision shapes are taken too",
    )
    margin: NonNegative = Field(0.01, description="distance kept [m]")
    by_meshes: tuple[tuple[str, str], ...] = Field(
        (),
        description="pairs of links, with at most two joints between them, that are checked by "
        "tables of their meshes' distances instead of their capsules",
    )
    ignore: tuple[tuple[str, str], ...] = Field((), description="pairs of links not to check")
    without_shapes: tuple[str, ...] = Field(
        (),
        description="links whose shapes are left out where their meshes are missing or cannot be "
        "read: collisions of these links are then not checked, and verdicts say so",
    )


class BoxSpec(Section):
    """A box that stands in the world: a table, a cabinet."""

    size: tuple[Positive, Positive, Positive] = Field(description="lengths of its edges [m]")
    position: Vector3 = Field(description="of its centre in the world [m]")
    orientation: Vector3 = Field((0.0, 0.0, 0.0), description="roll, pitch, yaw [rad]")


class WallSpec(Section):
    """A plane; the robot stays on the side that the normal points to."""

    point: Vector3 = Field(description="any point of it in the world [m]")
    normal: Vector3 = Field(description="towards the robot")

    @field_validator("normal")
    @classmethod
    def _direction(cls, value: Any) -> Any:
        if not any(value):
            raise ValueError("a normal of zeros has no direction")
        return value


class SurroundingsSpec(Section):
    """What stands around the robot; distances from its capsules."""

    floor: Finite | None = Field(None, description="height of the floor in the world [m]")
    walls: dict[str, WallSpec] = Field(default_factory=dict)
    boxes: dict[str, BoxSpec] = Field(default_factory=dict)
    margin: NonNegative = Field(0.02, description="distance kept [m]")
    ignore: tuple[tuple[str, str], ...] = Field(
        (), description="pairs of a link and an obstacle not to check: [[base_link, floor]]"
    )

    @model_validator(mode="after")
    def _something(self) -> "SurroundingsSpec":
        twice = set(self.walls) & set(self.boxes) | ({"floor"} & {*self.walls, *self.boxes})
        if twice:
            raise ValueError(f"named twice: {', '.join(sorted(twice))}")
        if self.floor is None and not self.walls and not self.boxes:
            raise ValueError("name at least a floor, a wall or a box")
        return self


KeepOutSpec = dict[str, tuple[Finite, Finite]]


class ConstraintsSpec(Section):
    """What a motion must keep; a part that is absent or null is not checked."""

    joint_limits: JointLimitsSpec | None = JointLimitsSpec()
    torque: TorqueSpec | None = None
    tracking_error: Positive | dict[str, Positive] | None = Field(
        None,
        description="[rad or m] how far set points may be from positions, or {joint: number}: what "
        "drives with `measurement.torque: command` need for the torque (and kd times the speed)",
    )
    balance: BalanceSpec | None = None
    contact: ContactSpec | None = None
    self_collision: SelfCollisionSpec | None = None
    surroundings: SurroundingsSpec | None = None
    keep_out: dict[str, KeepOutSpec] = Field(
        default_factory=dict,
        description="regions of joint space to stay out of: name, then joint: [from, to] of every "
        "joint that bounds it [rad or m]",
    )
    any_speed: bool = Field(
        False,
        description="torque and contact hold at any lower speed of a motion as well, down to "
        "standing still (`excite campaign` plans so where it begins slowly)",
    )
    own: dict[str, dict[str, Finite]] = Field(
        default_factory=dict,
        description="constraints without a section here, as those of packages, by name, with "
        "their settings",
        json_schema_extra={"x-family": "constraints"},
    )

    @field_validator("keep_out")
    @classmethod
    def _regions(cls, value: Any) -> Any:
        for name, region in value.items():
            if not region:
                raise ValueError(f"{name}: name at least one joint")
            for joint, (low, high) in region.items():
                if low >= high:
                    raise ValueError(f"{name}.{joint}: {low:g} is not below {high:g}")
        return value
