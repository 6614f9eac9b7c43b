"""Distances between capsules (Eq. 53 with its sign mended): d_ij ≥ r_i + r_j + margin."""

import numpy as np

from excite_cli.constraints.base import Array, Constraint, Indices
from excite_cli.dynamics.states import States
from excite_cli.geometry.clearance import Clearance
from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.proof.enclosed_distances import EnclosedCapsules
from excite_cli.proof.enclosed_motion import EnclosedMotion
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Robot

# Distances beyond this many metres above the margin do not concern the optimiser; less for a robot
# of thin links (this many times their radius), so that a hand need not open as far as an arm.
_NEAR, _LEAST_NEAR, _RADII = 0.1, 0.02, 2.5


class SelfCollision(Constraint):
    """One column per checked pair of capsules."""

    name = "self_collision"
    unit = "m"

    def __init__(
        self, robot: Robot, capsules: tuple[Capsule, ...], pairs: CollisionPairs, margin: float
    ) -> None:
        self.capsules, self.pairs, self.margin = capsules, pairs, margin
        self._clearance = Clearance(robot, capsules, pairs)
        self.labels = tuple(f"{capsules[i].name} – {capsules[j].name}" for i, j in pairs.checked)
        usual = float(np.median([capsule.radius for capsule in capsules]))
        self.scale = np.full(len(self.labels), np.clip(_RADII * usual, _LEAST_NEAR, _NEAR))

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

    def gradients(
        self, states: States, times: Indices, columns: Indices
    ) -> tuple[Array | None, Array | None, Array | None]:
        """Witness normal times the difference of the witness points' Jacobians."""
        return self._clearance.gradients(states, times, columns), None, None
