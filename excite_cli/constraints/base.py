"""The family of constraints: margins that must not be negative.

Every member has columns (a joint side, a capsule pair, an edge of the support) and gives, for each
instant and column, the margin in its own unit, and derivatives for those the optimiser asks for.
Members neither know the optimiser nor the trajectory, and nobody asks which member one is: what
the solver, the search for postures, `check`, reports and views can make use of, a member states by
what it overrides.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from excite_cli.arrays import Array as Array
from excite_cli.arrays import Indices as Indices
from excite_cli.constraints.drawing import Drawable

if TYPE_CHECKING:
    from excite_cli.constraints.joint_columns import JointColumns
    from excite_cli.constraints.setting import Setting
    from excite_cli.dynamics.forward_kinematics import States
    from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
    from excite_cli.proof.enclosed_motion import EnclosedMotion

Parts = tuple[Array | None, ...]
"""Derivatives (K, n) of K margins by q, v, a and, of members that bound it, jerk."""

_ROUNDING = 1e-12


def part_of(order: int, rows: Array) -> Parts:
    """Derivatives (K, n) of margins that depend on one derivative of q, that of this order."""
    return (*(None for _ in range(order)), rows)


def at_rest(states: States) -> States:
    """Standing still at the same positions."""
    return replace(states, v=0.0 * states.v, a=0.0 * states.a)


class Constraint(Drawable, ABC):
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

    @classmethod
    def build(cls, given: Any, setting: Setting) -> Iterable[Constraint]:
        """What a config asks for: `given` stands under its key; under `own`, numbers by name."""
        return [cls(setting.robot, **given)]  # type: ignore[call-arg]

    @abstractmethod
    def margins(self, states: States) -> Array:
        """Margins (T, m) in `unit`."""

    @abstractmethod
    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Derivatives (K, n) of K margins with respect to q, v, a (and jerk, where it is bounded).

        None where identically zero.
        """

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

    def margins_at_rest(self, states: States) -> Array:
        """Margins (T, m) of forces of a robot that stands still where `states` are."""
        return self.margins(at_rest(states))

    def gradients_at_rest(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Derivatives (K, n) of those margins."""
        return self.gradients(at_rest(states), times, columns)[:1]

    def least_at_rest(self, motion: EnclosedMotion) -> Array | None:
        """Lower bounds (T, m) on those margins over intervals."""
        return self.least(motion.at_rest)

    @property
    def of_joints(self) -> JointColumns | None:
        """Which joint each column bounds, and how; None where a column is about more than one."""
        return None

    @property
    def linear(self) -> JointColumns | None:
        """`of_joints` where the margins are linear in the coefficients of a motion, else None."""
        columns = self.of_joints
        return columns if columns is not None and columns.linear else None

    def independent_margins(self, states: States) -> Array | None:
        """Margins (T, m) by a computation that shares nothing with `margins` but the description.

        For `check`, which compares the two. None where there is no second way.
        """
        return None

    def why_not(self, states: States) -> str:
        """Why a real robot cannot stand as at the first of `states`, in words; empty if it can.

        For members whose margin is broken by more than what a small change should repair.
        """
        return ""

    def unit_of(self, column: int) -> str:
        """Unit of one column; prismatic joints differ from the others."""
        return self.unit
