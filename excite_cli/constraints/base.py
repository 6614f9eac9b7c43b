"""The family of constraints: margins that must not be negative.

Every member has columns (a joint side, a capsule pair, an edge of the support) and gives, for each
instant and column, the margin in its own unit, and derivatives for those the optimiser asks for.
Members neither know the optimiser nor the trajectory.
"""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.states import States
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.proof.worst_margin import Worst

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

        For members whose margin is broken by more than what a nudge should mend.
        """
        return ""

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
