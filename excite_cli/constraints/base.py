"""The family of constraints: margins that must not be negative.

Every member has columns (a joint side, a capsule pair, an edge of the support) and gives, for each
instant and column, the margin in its own unit, and derivatives for those the optimiser asks for.
Members neither know the optimiser nor the trajectory, and nobody asks which member one is: what
the solver, the search for postures, `check`, reports and views can make use of, a member states by
what it overrides.
"""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from excite_cli.constraints.drawing import ConstraintScene, NearestBodies
from excite_cli.constraints.joint_columns import JointColumns
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.reasons import DroppedPair
from excite_cli.proof.certificate import Worst
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.robot.capsule import Capsule
from excite_cli.shown.note import Note

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_ROUNDING = 1e-12


class Constraint(ABC):
    """Margins (T, m), one column per label; admissible where none is negative."""

    name: str
    unit: str
    labels: tuple[str, ...]
    scale: Array
    """Size (m,) by which the optimiser divides each column's margin."""
    uncertainty: InertiaUncertainty | None = None
    """Inertias for all of which the margins hold; None where those of the URDF are taken."""
    of_forces: bool = False
    """Whether it is about torques or forces, which change with the speed of a motion."""

    @property
    def title(self) -> str:
        """What the margin is, as the heading of a picture."""
        return self.name.replace("_", " ").capitalize()

    @property
    def of_joints(self) -> JointColumns | None:
        """Which joint each column bounds, and how; None where a column is about more than one."""
        return None

    @property
    def linear(self) -> JointColumns | None:
        """`of_joints` where the margins are linear in the coefficients of a motion, else None."""
        columns = self.of_joints
        return columns if columns is not None and columns.linear else None

    @property
    def left_out(self) -> tuple[DroppedPair, ...] | None:
        """Pairs that are not kept apart, with reasons; None where columns are not pairs.

        Pairs are chosen among those that can come near within the position limits.
        """
        return None

    def capsules_of(self, column: int) -> tuple[Capsule, ...]:
        """The robot's capsules, one or two, whose distance the column is; () for other margins."""
        return ()

    @abstractmethod
    def margins(self, states: States) -> Array:
        """Margins (T, m) in `unit`."""

    @property
    def rounding(self) -> Array:
        """What standing exactly at a bound may lack (m,): rounding, a share of the scale."""
        return np.asarray(_ROUNDING * self.scale)

    def margins_within(self, states: States, reach: Array) -> Array:
        """Margins (T, m) that are exact up to `reach` (m,) and at least `reach` beyond it.

        For members that can tell cheaply what is far away; here all are exact.
        """
        return self.margins(states)

    def least(self, motion: EnclosedMotion) -> Array | None:
        """Lower bounds (T, m) on the margins that hold throughout each of T intervals of time.

        Far from zero they may be loose, and in another measure than `margins`; the sign counts.
        None where no such bound is known.
        """
        return None

    @abstractmethod
    def gradients(
        self, states: States, times: Indices, columns: Indices
    ) -> tuple[Array | None, Array | None, Array | None]:
        """Derivatives (K, n) of K margins with respect to q, v, a; None where identically zero."""

    def why_not(self, states: States) -> str:
        """Why a real robot cannot stand as at the first of `states`, in words; empty if it can.

        For members whose margin is broken by more than what a small change should repair.
        """
        return ""

    def independent_margins(self, states: States) -> Array | None:
        """Margins (T, m) by a computation that shares nothing with `margins` but the description.

        For `check`, which compares the two. None where there is no second way.
        """
        return None

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

    def unit_of(self, column: int) -> str:
        """Unit of one column; prismatic joints differ from the others."""
        return self.unit

    def worst(self, margins: Array, times: Array) -> Worst:
        """The margin that is smallest as a share of its column's scale, and how many are broken."""
        t, column = divmod(int(np.argmin(margins / self.scale)), margins.shape[1])
        margin = float(margins[t, column])
        broken = int(np.count_nonzero(margins < -self.rounding))
        share = margin / float(self.scale[column])
        unit, label = self.unit_of(column), self.labels[column]
        return Worst(margin, unit, label, float(times[t]), broken, share)
