"""The torque that bounded joints may give on either side, at the speed that they have.

Column k bounds sign_k τ_j by c_j(sign_k v_j), with c_j the curve of the joint's motor
(`robot.effort_curve`), a constant for most.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.constraints.base import Array, Indices
from excite_cli.proof.taylor import Taylor
from excite_cli.robot.effort_curve import EffortCurve


class AvailableTorque:
    """Columns (m,) of `joints` with `signs`; `curves` (m,) [N·m or N]."""

    def __init__(self, joints: Indices, signs: Array, curves: Sequence[EffortCurve]) -> None:
        self._joints, self._signs, self._curves = joints, signs, tuple(curves)
        self.still = np.array([curve.efforts[0] for curve in self._curves])
        """What there is of torque at no speed (m,)."""
        self._varying = [k for k, curve in enumerate(self._curves) if len(curve.speeds) > 1]

    def at(self, v: Array) -> Array:
        """c(sign v) (T, m) at speeds (T, n)."""
        found = np.tile(self.still, (len(v), 1))
        for k in self._varying:
            found[:, k] = self._curves[k].effort(self._signs[k] * v[:, self._joints[k]])
        return found

    def add_slopes(self, by_v: Array, v: Array, columns: Indices) -> None:
        """Add the derivatives of c(sign v) at speeds (K, n) of `columns` (K,) to `by_v` (K, n)."""
        for k in self._varying:
            rows, sign = np.flatnonzero(columns == k), self._signs[k]
            joint = self._joints[k]
            by_v[rows, joint] += sign * self._curves[k].slope(sign * v[rows, joint])

    def least(self, v: Taylor) -> Taylor:
        """What is below c(sign v) (T, m) throughout intervals, with v enclosing (T, n).

        Where speeds stay on one line, that line; else the torque at the highest of them, since no
        curve rises.
        """
        terms = np.zeros((3, v.shape[0], len(self._curves)))
        terms[0] = self.still
        radius = np.zeros(terms.shape[1:])
        for k in self._varying:
            curve, speed = self._curves[k], v[:, self._joints[k]].scaled(self._signs[k])
            first, last = curve.line(speed.lower()), curve.line(speed.upper())
            slope = np.where(first == last, curve.slopes[first], 0.0)
            one_line = speed.scaled(slope) + (curve.efforts[first] - slope * curve.speeds[first])
            terms[:, :, k], radius[:, k] = one_line.terms, one_line.radius
            terms[0, :, k] = np.where(first == last, one_line.terms[0], curve.effort(speed.upper()))
        return Taylor(terms, radius)
