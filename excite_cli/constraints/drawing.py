"""What a constraint has to show: bodies, regions and the nearest points, for any way to draw."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excite_cli.geometry.obstacles import Obstacle
from excite_cli.robot.capsule import Capsule

Array = NDArray[np.float64]


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
