"""Centre of mass above a convex region of the ground (Eq. 52), as half-planes.

A disc is taken as its inscribed regular polygon: linear in the centre of mass, whereas the
quadratic form has no gradient at the centre. The polygon has 16 sides and gives away 2 % of the
radius.

With uncertain inertias the margin (offset M − normal·Σ m c) / M is the least over all admitted φ:
numerator and mass are linear in φ (`dynamics.least_ratio`).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from excite_cli.config.constraints_spec import DiscSpec, PolygonSpec
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.drawing import ConstraintScene, GroundRegion
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.least_ratio import Ratios, least_ratios, worst_inertias
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.dynamics.whole_robot import CenterOfMass, drawn_states
from excite_cli.errors import ConfigError
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.enclosed_rows import combined, least_of, mass_rows
from excite_cli.robot.model import Robot

DISC_SIDES = 16
# A robot that may weigh less than this share of its mass has no centre of mass to speak of.
_LIGHTEST = 0.05
_MASS = np.array([1.0, 0.0, 0.0])


class Balance(Constraint):
    """normal·c ≤ offset for every edge; `normals` (m, 2), `offsets` (m,) [m].

    `uncertainty`: admitted inertias of the whole robot; None: those of the URDF.
    """

    name = "balance"
    title = "Centre of mass to the edge of its region"
    unit = "m"

    def __init__(
        self,
        robot: Robot,
        normals: Array,
        offsets: Array,
        center: Array,
        uncertainty: InertiaUncertainty | None = None,
    ) -> None:
        self._mass = CenterOfMass(robot)
        self.normals, self.offsets, self.center = normals, offsets, center
        support = Support(normals, offsets, center)
        self.labels, self.scale = support.labels, support.scale
        self.uncertainty = uncertainty
        self._last: tuple[States, Array, Ratios] | None = None
        self._known = uncertainty or InertiaUncertainty.none(robot)
        if uncertainty is not None:
            states = drawn_states(robot)
            rows = self._functionals @ self._mass.rows(states)
            of_masses = rows.reshape(-1, rows.shape[-1])
            full = np.zeros((len(of_masses), len(of_masses[0]) // 4 * 10))
            full[:, np.arange(full.shape[1]) % 10 < 4] = of_masses
            # One choice for margins and proof, lest they contradict each other.
            self._known = uncertainty.sharpest(full)
            self._admitted = self._known.of_masses()

    @classmethod
    def build(cls, spec: DiscSpec | PolygonSpec, setting: Setting) -> Iterable[Constraint]:
        """A disc, or a polygon."""
        robot, uncertainty = setting.robot, setting.uncertainty
        if isinstance(spec, PolygonSpec):
            return [cls.polygon(robot, np.array(spec.vertices), spec.margin, uncertainty)]
        if spec.center == "posture":
            center = setting.posture_center_of_mass()
        else:
            center = np.array(spec.center, dtype=float)
        return [cls.disc(robot, center, spec.radius, uncertainty)]

    @classmethod
    def disc(
        cls,
        robot: Robot,
        center: Array,
        radius: float,
        uncertainty: InertiaUncertainty | None = None,
    ) -> "Balance":
        """Disc of `radius` [m] about `center` (2,)."""
        angles = 2 * np.pi * np.arange(DISC_SIDES) / DISC_SIDES
        normals = np.column_stack([np.cos(angles), np.sin(angles)])
        offsets = normals @ center + radius * np.cos(np.pi / DISC_SIDES)
        return cls(robot, normals, offsets, center, uncertainty)

    @classmethod
    def polygon(
        cls,
        robot: Robot,
        vertices: Array,
        margin: float,
        uncertainty: InertiaUncertainty | None = None,
    ) -> "Balance":
        """Convex hull of `vertices` (k, 2), shrunk by `margin` [m] at every edge.

        Raises
        ------
        ConfigError
            The vertices lie on a line, or nothing is left inside the margin.
        """
        support = support_polygon(vertices, margin, "constraints.balance")
        return cls(robot, support.normals, support.offsets, support.center, uncertainty)

    @property
    def drawing(self) -> ConstraintScene:
        """The region that the centre of mass is kept in."""
        return ConstraintScene(region=GroundRegion(self.normals, self.offsets))

    def margins(self, states: States) -> Array:
        """Distance of the centre of mass to each edge, inwards (T, m) [m]."""
        if self.uncertainty is None:
            return self.offsets - self._mass.position(states)[:, :2] @ self.normals.T
        return self._worst(states)[1].values

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on (offset M − normal·Σ m c) / M̂ (T, m) [m], M̂ the URDF's mass."""
        rows = mass_rows(motion)
        edges = combined(self._functionals, rows)
        return least_of(edges, self._known) / self._mass.total_mass

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """−normalᵀ ∂c/∂q, with the worst inertias of each edge and instant."""
        if self.uncertainty is None:
            towards = -self.normals @ self._mass.jacobian(states)[:, :2]
            return towards[times, columns], None, None
        rows, found = self._worst(states)
        at = (times, columns)
        proper = found.proper[at]
        ratio = np.where(proper, found.values[at], 0.0)[:, None]
        y = np.einsum("kr,krp->kp", self._functionals[columns] - ratio * _MASS, rows[times])
        masses = worst_inertias(self._admitted, y, found.pieces[at])
        change = self._mass.moment_gradients(states, times, self.normals[columns], masses)
        weight = np.where(proper, masses[:, ::4].sum(axis=1), self._least_mass)
        return -change / weight[:, None], None, None

    def _worst(self, states: States) -> tuple[Array, Ratios]:
        """Rows of mass and first moments, and the margins; those last requested are kept."""
        if self._last is None or self._last[0] is not states:
            rows, least = self._mass.rows(states), self._least_mass
            found = least_ratios(self._admitted, rows, self._functionals, _MASS, least)
            self._last = states, rows, found
        return self._last[1:]

    @property
    def _functionals(self) -> Array:
        """offset M − normal·Σ m c (m, 3) on M, Σ m x, Σ m y."""
        return np.column_stack([self.offsets, -self.normals])

    @property
    def _least_mass(self) -> float:
        return _LIGHTEST * self._mass.total_mass


# A convex region of the ground as half-planes normal·x ≤ offset.


@dataclass(frozen=True)
class Support:
    """`normals` (m, 2) of unit length, outwards; `offsets` (m,) [m]; `center` (2,) within [m]."""

    normals: Array
    offsets: Array
    center: Array

    @property
    def scale(self) -> Array:
        """Distance (m,) [m] of the centre from each edge."""
        return np.asarray(self.offsets - self.normals @ self.center)

    @property
    def labels(self) -> tuple[str, ...]:
        """Every edge by the direction that it lies in."""
        degrees = np.degrees(np.arctan2(self.normals[:, 1], self.normals[:, 0])) % 360
        return tuple(f"towards {angle:.0f}°" for angle in degrees)


def support_polygon(vertices: Array, margin: float, where: str) -> Support:
    """Convex hull of `vertices` (k, 2), shrunk by `margin` [m] at every edge.

    `where`: the section of the config, for messages.

    Raises
    ------
    ConfigError
        The vertices lie on a line, or nothing is left inside the margin.
    """
    try:
        hull = ConvexHull(vertices)
    except QhullError as error:
        raise ConfigError(f"{where}.vertices: all points lie on a line.") from error
    edges = np.unique(hull.equations.round(12), axis=0)
    offsets = -edges[:, 2] - margin
    center = vertices[hull.vertices].mean(axis=0)
    if np.any(offsets - edges[:, :2] @ center <= 0):
        raise ConfigError(f"{where}: a margin of {margin:g} m leaves nothing of the polygon.")
    return Support(edges[:, :2], offsets, center)
