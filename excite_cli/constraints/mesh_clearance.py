"""Distances between meshes of links so near each other that their capsules always overlap."""

import numpy as np

from excite_cli.constraints.base import Array, Constraint, Indices, Parts
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.geometry.pair_table import PairTable
from excite_cli.geometry.pair_tables import FAR
from excite_cli.geometry.reasons import DroppedPair
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.taylor import Taylor
from excite_cli.shown.note import Level, Note

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
