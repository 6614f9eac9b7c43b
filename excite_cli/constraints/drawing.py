"""What a constraint has to show: bodies, regions and the nearest points, for any way to draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from excite_cli.dynamics.forward_kinematics import States
    from excite_cli.geometry.link_meshes import Poses
    from excite_cli.geometry.obstacles import Obstacle
    from excite_cli.geometry.reasons import DroppedPair
    from excite_cli.robot.capsule import Capsule
    from excite_cli.robot.model import Array
    from excite_cli.shown.note import Note


@dataclass(frozen=True, eq=False)
class GroundRegion:
    """What a point on the ground is kept in: normal·x ≤ offset, (m, 2) and (m,) [m].

    height [m]: of the ground; None where any will do. contacts (k, 2) [m]: where the robot stands.
    """

    normals: Array
    offsets: Array
    height: float | None = None
    contacts: Array | None = None


@dataclass(frozen=True, eq=False)
class ConstraintScene:
    """What is there at all times: bodies that distances are taken of, obstacles, a region."""

    capsules: tuple[Capsule, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    region: GroundRegion | None = None


@dataclass(frozen=True, eq=False)
class NearestBodies:
    """The nearest two bodies at each of T instants, of the robot or one of them an obstacle.

    distances (T,) [m], negative where they overlap; ends (T, 2, 3) [m], the points between which
    the distance is; capsules: the one or two of the robot; labels: T texts.
    """

    distances: Array
    ends: Array
    capsules: tuple[tuple[Capsule, ...], ...]
    labels: tuple[str, ...]


class Drawable:
    """What a constraint is called, says of itself and shows: by default no more than its margin."""

    name: str

    @property
    def title(self) -> str:
        """What the margin is, as the heading of a picture."""
        return self.name.replace("_", " ").capitalize()

    @property
    def left_out(self) -> tuple[DroppedPair, ...] | None:
        """Pairs that are not kept apart, with reasons; None where columns are not pairs.

        Pairs are chosen among those that can come near within the position limits.
        """
        return None

    def capsules_of(self, column: int) -> tuple[Capsule, ...]:
        """The robot's capsules, one or two, whose distance the column is; () for other margins."""
        return ()

    @property
    def remarks(self) -> tuple[Note, ...]:
        """What is worth saying about it before work begins."""
        return ()

    @property
    def drawing(self) -> ConstraintScene:
        """What of it can be drawn, at rest."""
        return ConstraintScene()

    def nearest(self, poses: Poses, margins: Array) -> NearestBodies | None:
        """The nearest two bodies at poses with these margins (T, m); None without `drawing`s."""
        return None

    def ground_point(self, states: States) -> Array | None:
        """World x, y (T, 2) [m] of what the region drawn is for, if not for the centre of mass."""
        return None
