"""What the ground can give to a robot that stands on it: Wieber's conditions for a planar contact.

Gravity and motion ask for a wrench W = [f; n] of the ground, n about the world origin. At height h

    zero-moment point   p = (−(n_y − h f_x), n_x + h f_y) / f_z     within the support polygon
    friction            |f_x|, |f_y| ≤ μ f_z                         a pyramid along x and y
    torsion             |n_z − (c × f)_z| ≤ ν f_z                    about the polygon's middle c
    load                f_z ≥ least load.

All but p are linear in W, hence in the inertias, and p is a quotient of linear forms: the worst
case over uncertain inertias is `robot.least_ratio`. Torsion is taken about the fixed point c, and
not about p, to stay linear; both agree where the horizontal force is small. Up is the world's z. A
base that stands still is taken to stand with all of its feet.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from excite_cli.config.constraints_spec import ContactSpec
from excite_cli.constraints.balance import Support, support_polygon
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.drawing import ConstraintScene, GroundRegion
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.least_ratio import Ratios, least_ratios, least_values, worst_inertias
from excite_cli.dynamics.row_adjoint import RowAdjoint
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.dynamics.whole_robot import GroundWrench, drawn_states, whole_parameters
from excite_cli.errors import ConfigError
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.enclosed_rows import combined, ground_rows, least_of
from excite_cli.robot.model import Robot

# Below this share of the weight a load has no zero-moment point to speak of.
_LEAST_LOAD = 0.05
# Room that counts as near: this share of what the ground gives under the weight.
_ROOM = 0.5
_LOAD = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Ground:
    """Wrench of the ground on `robot` with admitted inertias, shared by its constraints.

    `weight` [N]: the vertical force at rest with the middle inertias.
    """

    robot: Robot
    uncertainty: InertiaUncertainty
    wrench: GroundWrench
    adjoint: RowAdjoint
    weight: float

    @classmethod
    def under(cls, robot: Robot, uncertainty: InertiaUncertainty | None) -> "Ground":
        """None: the inertias of the URDF."""
        admitted = uncertainty or InertiaUncertainty.none(robot)
        mass = float(admitted.pieces[0].center[::10].sum())
        weight = -mass * float(robot.model.gravity.linear[2])
        return cls(robot, admitted, GroundWrench(robot), RowAdjoint(robot), weight)

    def admitted(self, functionals: Array) -> InertiaUncertainty:
        """What bounds `functionals` (m, 6) of the wrench."""
        y = functionals @ self.wrench.regressor(drawn_states(self.robot))
        return self.uncertainty.sharpest(y.reshape(-1, y.shape[-1]))

    def gradients(
        self, states: States, times: Indices, functionals: Array, phi: Array
    ) -> tuple[Array, Array, Array]:
        """Derivatives (K, n) of functionals (K, 6) on W with inertias φ (K, P) of their own."""
        q, v, a = states.q, states.v, states.a
        return self.adjoint.wrenches(q, v, a, times, functionals, phi[:, 10:])


class ZeroMomentPoint(Constraint):
    """normal·p ≤ offset for every edge of the support; margins in metres.

    `contacts` (k, 2) [m]: the points of which the support is the hull.
    """

    uncertainty: InertiaUncertainty
    name = "zmp"
    of_forces = True
    title = "Zero-moment point to the edge of the support"
    unit = "m"

    def __init__(self, ground: Ground, support: Support, height: float, contacts: Array) -> None:
        self.ground, self.support, self.height, self.contacts = ground, support, height, contacts
        self.labels, self.scale = support.labels, support.scale
        x, y = support.normals.T
        zero = np.zeros_like(x)
        self.functionals = np.column_stack([-height * x, -height * y, support.offsets, -y, x, zero])
        self._floor = _LEAST_LOAD * ground.weight
        self._last: tuple[States, Ratios] | None = None
        self.uncertainty = ground.admitted(self.functionals)

    @property
    def drawing(self) -> ConstraintScene:
        """The support, at the height of the ground."""
        edges = self.support.normals, self.support.offsets
        return ConstraintScene(region=GroundRegion(*edges, self.height, self.contacts))

    def ground_point(self, states: States) -> Array:
        """The zero-moment point with the inertias of the URDF."""
        wrench = self.ground.wrench.regressor(states) @ whole_parameters(self.ground.robot)
        load = np.where(np.abs(wrench[:, 2]) > 1e-9, wrench[:, 2], np.nan)
        x = -(wrench[:, 4] - self.height * wrench[:, 0]) / load
        y = (wrench[:, 3] + self.height * wrench[:, 1]) / load
        return np.column_stack([x, y])

    def margins(self, states: States) -> Array:
        """Distance of the zero-moment point to each edge, inwards (T, m) [m]."""
        return self._worst(states).values

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on a·W over the weight (T, m) [m], whose sign is that of the margin."""
        wrench = ground_rows(motion, np.zeros(3))
        return least_of(combined(self.functionals, wrench), self.uncertainty) / self.ground.weight

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Those of (a − λ f_z)·W / f_z with the worst inertias of each edge and instant."""
        rows, at = self.ground.wrench.regressor(states), (times, columns)
        found = self._worst(states)
        proper = found.proper[at]
        ratio = np.where(proper, found.values[at], 0.0)[:, None]
        functionals = self.functionals[columns] - ratio * _LOAD
        y = np.einsum("kr,krp->kp", functionals, rows[times])
        phi = worst_inertias(self.uncertainty, y, found.pieces[at])
        parts = self.ground.gradients(states, times, functionals, phi)
        load = np.einsum("kp,kp->k", rows[times, 2], phi)
        divisor = np.where(proper, load, self._floor)[:, None]
        by_q, by_v, by_a = (part / divisor for part in parts)
        return by_q, by_v, by_a

    def _worst(self, states: States) -> Ratios:
        """The margins; those last requested are kept."""
        if self._last is None or self._last[0] is not states:
            rows = self.ground.wrench.regressor(states)
            found = least_ratios(self.uncertainty, rows, self.functionals, _LOAD, self._floor)
            self._last = states, found
        return self._last[1]


class GroundContact(Constraint):
    """Friction, torsion and load: functionals·W ≥ `least_values`, (m, 6) on [f; n] and (m,)."""

    uncertainty: InertiaUncertainty
    name = "contact"
    of_forces = True
    title = "What is left of friction, torsion and load"
    unit = "N"

    def __init__(
        self,
        ground: Ground,
        center: Array,
        friction: float | None,
        torsion: float | None,
        min_load: float,
    ) -> None:
        self.ground = ground
        x, y = center
        forms = {"load": (_LOAD, min_load, 1.0, "N")}
        for sign, name in ((1.0, "+"), (-1.0, "-")):
            if friction is not None:
                for axis, letter in enumerate("xy"):
                    side = friction * _LOAD - sign * np.eye(6)[axis]
                    forms[f"friction {name}{letter}"] = (side, 0.0, friction, "N")
            if torsion is not None:
                turn = np.array([y, -x, 0.0, 0.0, 0.0, 1.0])
                forms[f"torsion {name}"] = (torsion * _LOAD - sign * turn, 0.0, torsion, "N·m")
        self.labels = tuple(forms)
        self.functionals = np.array([form[0] for form in forms.values()])
        self.least_values = np.array([form[1] for form in forms.values()])
        self.scale = _ROOM * ground.weight * np.array([form[2] for form in forms.values()])
        self._units = tuple(form[3] for form in forms.values())
        self.uncertainty = ground.admitted(self.functionals)

    @classmethod
    def build(cls, spec: ContactSpec, setting: Setting) -> Iterable[Constraint]:
        """With a support polygon also the zero-moment point."""
        robot = setting.robot
        ground = Ground.under(robot, setting.uncertainty)
        if ground.weight <= 0:
            raise ConfigError(
                "constraints.contact: gravity does not press this robot on the ground. It needs a "
                "mass and robot.gravity with a negative z; leave contact out for what is not on "
                "the ground."
            )
        found: list[Constraint] = []
        center = None
        if spec.vertices is not None:
            feet = np.array(spec.vertices, dtype=float)
            support = support_polygon(feet, spec.margin, "constraints.contact")
            found.append(ZeroMomentPoint(ground, support, spec.height, feet))
            center = support.center
        if center is None:
            center = setting.posture_center_of_mass()
        found.append(cls(ground, center, spec.friction, spec.torsion, spec.min_load))
        return found

    def unit_of(self, column: int) -> str:
        """Newton metres for torsion."""
        return self._units[column]

    def margins(self, states: States) -> Array:
        """What is left of friction, torsion and load (T, m) [N, N·m]."""
        return self._least_of(self.ground.wrench.regressor(states))[0] - self.least_values

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on functionals·W − least (T, m) [N, N·m]."""
        wrench = ground_rows(motion, np.zeros(3))
        return least_of(combined(self.functionals, wrench), self.uncertainty) - self.least_values

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Those of functionals·W with the worst inertias of each."""
        instants, inverse = np.unique(times, return_inverse=True)
        rows = self.ground.wrench.regressor(states)[instants]
        pieces = self._least_of(rows)[1][inverse, columns]
        functionals = self.functionals[columns]
        y = np.einsum("kr,krp->kp", functionals, rows[inverse])
        phi = worst_inertias(self.uncertainty, y, pieces)
        return self.ground.gradients(states, times, functionals, phi)

    def _least_of(self, rows: Array) -> tuple[Array, Indices]:
        return least_values(self.uncertainty, rows, self.functionals)
