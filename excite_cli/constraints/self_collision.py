"""Distances between capsules (Eq. 53 with its sign corrected): d_ij ≥ r_i + r_j + margin."""

from collections.abc import Iterable

import numpy as np

from excite_cli.config.constraints_spec import SelfCollisionSpec
from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.constraints.drawing import ConstraintScene, NearestBodies
from excite_cli.constraints.nearest_bodies import nearest_capsules
from excite_cli.constraints.setting import Setting
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.geometry.collision_pairs import CollisionPairs, choose_pairs
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.mesh_distances import CoalDistances
from excite_cli.geometry.mesh_pairs import PairTable
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.geometry.pair_tables import FAR, mesh_tables, require_tabled
from excite_cli.geometry.reasons import DroppedPair, counted_reasons
from excite_cli.proof.enclosed_distances import EnclosedCapsules
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.taylor import Taylor
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot
from excite_cli.shown.note import Level, Note

# Clearance of a motion: distances of the checked pairs of capsules.


class Clearance(PairDistances):
    """Signed distances [m] of the checked pairs, column k being `pairs.checked[k]`.

    `names` gives the two capsules of each column, for messages and reports.
    """

    def __init__(self, robot: Robot, capsules: tuple[Capsule, ...], pairs: CollisionPairs) -> None:
        super().__init__(robot, capsules, pairs.checked)
        self.names = tuple((capsules[i].name, capsules[j].name) for i, j in pairs.checked)


# Distances beyond this many metres above the margin do not concern the optimiser; less for a robot
# of thin links (this many times their radius), so that a hand need not open as far as an arm.
_NEAR, _LEAST_NEAR, _RADII = 0.1, 0.02, 2.5


class SelfCollision(Constraint):
    """One column per checked pair of capsules.

    `tabled`: pairs of links whose meshes are kept apart instead.
    """

    name = "self_collision"
    title = "Nearest pair of links, less the margin"
    unit = "m"

    def __init__(
        self,
        robot: Robot,
        capsules: tuple[Capsule, ...],
        pairs: CollisionPairs,
        margin: float,
        tabled: tuple[tuple[str, str], ...] = (),
    ) -> None:
        self._robot = robot
        self.capsules, self.pairs, self.margin, self.tabled = capsules, pairs, margin, tabled
        self._clearance = Clearance(robot, capsules, pairs)
        self.labels = tuple(f"{capsules[i].name} – {capsules[j].name}" for i, j in pairs.checked)
        usual = float(np.median([capsule.radius for capsule in capsules]))
        self.scale = np.full(len(self.labels), np.clip(_RADII * usual, _LEAST_NEAR, _NEAR))

    @classmethod
    def build(cls, spec: SelfCollisionSpec, setting: Setting) -> Iterable[Constraint]:
        """By capsules, and by meshes where these are asked for."""
        robot, capsules = setting.robot, setting.capsules
        pairs = choose_pairs(robot, capsules, spec, bounded=setting.bounded)
        require_tabled(robot, capsules, spec.by_meshes)
        tables = mesh_tables(robot, capsules, pairs, spec.ignore)
        meshes = [MeshClearance(tables, min(KEPT, spec.margin))] if tables else []
        if not pairs.checked:
            return meshes
        tabled = tuple((table.first, table.second) for each in meshes for table in each.tables)
        return [cls(robot, capsules, pairs, spec.margin, tabled), *meshes]

    @property
    def left_out(self) -> tuple[DroppedPair, ...]:
        """Pairs of capsules."""
        return self.pairs.dropped

    def capsules_of(self, column: int) -> tuple[Capsule, ...]:
        """Both."""
        return tuple(self.capsules[index] for index in self.pairs.checked[column])

    @property
    def remarks(self) -> tuple[Note, ...]:
        """How many pairs are checked, and which are not that might meet."""
        count = Note(
            Level.DETAIL,
            f"self-collision: {len(self.capsules)} capsules, {len(self.labels)} pairs checked; not "
            f"checked: {counted_reasons(self.pairs.dropped)}",
        )
        loose = {
            f"{links.first} – {links.second} {links.percent}%"
            for pair in self.pairs.dropped
            for links in pair.reason.apart
            if links.percent < 100 and (links.first, links.second) not in self.tabled
        }
        if not loose:
            return (count,)
        warning = (
            "not guarded, since their capsules overlap in every posture "
            "(links and the share of postures in which their meshes are separated): "
            f"{'; '.join(sorted(loose))}. Look at these with `excite check`, or give slimmer "
            "capsules under constraints.self_collision.capsules."
        )
        return count, Note(Level.WARNING, warning)

    @property
    def drawing(self) -> ConstraintScene:
        """All capsules."""
        return ConstraintScene(self.capsules)

    def nearest(self, poses: Poses, margins: Array) -> NearestBodies:
        """The nearest pair of capsules."""
        checked, distances = self.pairs.checked, margins + self.margin
        return nearest_capsules(poses, distances, self.labels, self.capsules, checked)

    def independent_margins(self, states: States) -> Array:
        """By Pinocchio and coal."""
        coal = CoalDistances(self._robot, self.capsules, self.pairs.checked)
        return coal.distances(states.q) - self.margin

    def margins(self, states: States) -> Array:
        """Distance less the margin (T, m) [m]."""
        return self._clearance.distances(states) - self.margin

    def margins_within(self, states: States, reach: Array) -> Array:
        """As `margins`; pairs plainly farther apart than `reach` get a bound beyond it instead."""
        farthest = self.margin + float(reach.max(initial=0.0))
        return self._clearance.distances(states, exact_below=farthest) - self.margin

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds on distance less the margin (T, m) [m]."""
        axes = EnclosedCapsules(self.capsules, motion)
        first, second = np.array(self.pairs.checked, dtype=np.intp).T
        return axes.least_distances(first, second, self.margin) - self.margin

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Witness normal times the difference of the witness points' Jacobians."""
        return self._clearance.gradients(states, times, columns), None, None


KEPT = 0.002
"""Distance kept [m]: meshes need less than capsules, and more would take too much of the range."""


class MeshClearance(Constraint):
    """One column per tabulated pair of links: distance less `margin` and the error of the table."""

    name = "mesh_clearance"
    title = "Nearest pair of meshes, less the margin"
    unit = "m"

    def __init__(self, tables: tuple[PairTable, ...], margin: float = KEPT) -> None:
        self.tables, self.margin = tables, margin
        self.labels = tuple(f"{table.first} – {table.second}" for table in tables)
        self._kept = np.array([margin + table.error for table in tables])
        self.scale = np.full(len(tables), FAR)

    @property
    def left_out(self) -> tuple[DroppedPair, ...]:
        """None: capsules are asked first, and say why."""
        return ()

    @property
    def remarks(self) -> tuple[Note, ...]:
        """Why there are such pairs."""
        count = f"mesh clearance: {len(self.labels)} pairs checked by their meshes"
        return (Note(Level.DETAIL, f"{count}, since their capsules overlap in every posture"),)

    def margins(self, states: States) -> Array:
        """Distance less what is kept (T, m) [m], exact up to some centimetres."""
        distances = np.stack([table.distances(states.q) for table in self.tables], axis=1)
        return distances - self._kept

    def least(self, motion: EnclosedMotion) -> Array:
        """Lower bounds (T, m) [m]: tangent planes of the tables less what their bends can add."""
        q = motion.states.q
        found = []
        for table in self.tables:
            at = list(table.joints)
            reach = q.reach[:, at]
            slopes = table.slopes(q.center)
            way = Taylor(q.terms[:, :, at].copy(), q.radius[:, at])
            way.terms[0] = 0.0
            change = way.scaled(slopes).summed(-1).lower()
            one, both, other = table.bends
            r, s = reach.T
            bend = 0.5 * (one * r * r + 2 * both * r * s + other * s * s)
            least = table.distances(q.center) + change - bend
            middle = table.positions(q.center)
            inside = table.holds(middle - reach) & table.holds(middle + reach)
            found.append(np.where(inside, least, -np.inf))
        return np.stack(found, axis=1) - self._kept

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Slopes of the tables by the two joints of each."""
        rows = np.zeros((len(times), states.q.shape[1]))
        for column, table in enumerate(self.tables):
            at = np.flatnonzero(columns == column)
            if len(at):
                rows[at[:, None], list(table.joints)] = table.slopes(states.q[times[at]])
        return rows, None, None
