"""Limits of forces for a robot that stands still in every position of a motion.

Played s ≤ 1 times as fast, a motion needs the torques, or the wrench on the ground,

    f(q, s q̇, s² q̈) = (1 − s²) f(q, 0, 0) + s² f(q, q̇, q̈)

because what does not hold up the weight grows with the square of the speed. Limits of torque, zero
moment point, load and friction are convex in f, for every inertia that is admitted. So a motion
that keeps them as it is and standing still keeps them at any lower speed. Where a motor has less
torque at speed, standing still must do with that of the motion's speed: c(s v) ≥ c(v) then is
enough in between.
"""

from excite_cli.constraints.base import Array, Constraint, Indices, Parts, at_rest
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.proof.enclosed_motion import EnclosedMotion


class Standing(Constraint):
    """The margins (T, m) of a constraint `of` forces at rest in the positions of the states."""

    def __init__(self, of: Constraint) -> None:
        self._of = of
        self.name, self.unit, self.labels = f"{of.name}_standing", of.unit, of.labels
        self.scale, self.uncertainty = of.scale, of.uncertainty

    @property
    def title(self) -> str:
        """That of the constraint, standing."""
        return f"{self._of.title}, standing"

    @property
    def rounding(self) -> Array:
        """That of the constraint."""
        return self._of.rounding

    def unit_of(self, column: int) -> str:
        """That of the constraint."""
        return self._of.unit_of(column)

    def margins(self, states: States) -> Array:
        """Margins (T, m) of the constraint with v and a zero."""
        return self._of.margins_at_rest(states)

    def least(self, motion: EnclosedMotion) -> Array | None:
        """Lower bounds (T, m) over intervals, of a robot that stands somewhere within each."""
        return self._of.least_at_rest(motion)

    def gradients(self, states: States, times: Indices, columns: Indices) -> Parts:
        """Derivatives (K, n), of most with respect to q alone."""
        return self._of.gradients_at_rest(states, times, columns)

    def independent_margins(self, states: States) -> Array | None:
        """By the constraint's second way, with v and a zero."""
        return self._of.independent_margins(at_rest(states))
