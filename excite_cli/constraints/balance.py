"""Centre of mass above a convex region of the ground (Eq. 52), as half-planes.

A disc is taken as its inscribed regular polygon: linear in the centre of mass, whereas the
quadratic form has no gradient at the centre. The polygon has 16 sides and gives away 2 % of the
radius.
"""

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from excite_cli.constraints.base import Array, Constraint, Indices
from excite_cli.errors import ConfigError
from excite_cli.robot.center_of_mass import CenterOfMass
from excite_cli.robot.model import Robot
from excite_cli.robot.states import States

DISC_SIDES = 16


class Balance(Constraint):
    """normal·c ≤ offset for every edge; `normals` (m, 2), `offsets` (m,) [m]."""

    name = "balance"
    unit = "m"

    def __init__(self, robot: Robot, normals: Array, offsets: Array, center: Array) -> None:
        self._mass = CenterOfMass(robot)
        self.normals, self.offsets, self.center = normals, offsets, center
        self.labels = tuple(
            f"towards {np.degrees(np.arctan2(y, x)) % 360:.0f}°" for x, y in normals
        )
        self.scale = offsets - normals @ center

    @classmethod
    def disc(cls, robot: Robot, center: Array, radius: float) -> "Balance":
        """Disc of `radius` [m] about `center` (2,)."""
        angles = 2 * np.pi * np.arange(DISC_SIDES) / DISC_SIDES
        normals = np.column_stack([np.cos(angles), np.sin(angles)])
        return cls(robot, normals, normals @ center + radius * np.cos(np.pi / DISC_SIDES), center)

    @classmethod
    def polygon(cls, robot: Robot, vertices: Array, margin: float) -> "Balance":
        """Convex hull of `vertices` (k, 2), shrunk by `margin` [m] at every edge.

        Raises
        ------
        ConfigError
            The vertices lie on a line, or nothing is left inside the margin.
        """
        try:
            hull = ConvexHull(vertices)
        except QhullError as error:
            raise ConfigError("constraints.balance.vertices: all points lie on a line.") from error
        edges = np.unique(hull.equations.round(12), axis=0)
        offsets = -edges[:, 2] - margin
        center = vertices[hull.vertices].mean(axis=0)
        if np.any(offsets - edges[:, :2] @ center <= 0):
            raise ConfigError(
                f"constraints.balance: a margin of {margin:g} m leaves nothing of the polygon."
            )
        return cls(robot, edges[:, :2], offsets, center)

    def margins(self, states: States) -> Array:
        """Distance of the centre of mass to each edge, inwards (T, m) [m]."""
        return self.offsets - self._mass.position(states)[:, :2] @ self.normals.T

    def gradients(
        self, states: States, times: Indices, columns: Indices
    ) -> tuple[Array | None, Array | None, Array | None]:
        """−normalᵀ ∂c/∂q."""
        jacobian = self._mass.jacobian(states)[times, :2]
        return -np.einsum("kx,kxn->kn", self.normals[columns], jacobian), None, None
