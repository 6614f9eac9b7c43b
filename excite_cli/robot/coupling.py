"""Joints that follow others: the motion of all joints from that of those that move on their own.

    q_all = C q + c,    v_all = C v,    a_all = C a,    τ = Cᵀ τ_all

by virtual power. C has one entry a row, the multiplier of the joint that is followed, so everything
that is known of all joints (regressor, gradients, enclosures over intervals) is known exactly of
those that move on their own.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from excite_cli.robot.limits import Limits

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coupling:
    """All joints that move, m of them, by the n that move on their own.

    `joint_names` (m,) in the order of the model; `driver` (m,) the joint among the n that each
    follows, of those that move on their own themselves; `multiplier` and `offset` (m,); `limits`
    of each joint by itself.
    """

    joint_names: tuple[str, ...]
    driver: NDArray[np.intp]
    multiplier: Array
    offset: Array
    limits: Limits

    @cached_property
    def matrix(self) -> Array:
        """C (m, n)."""
        found = np.zeros((len(self.driver), int(self.driver.max()) + 1))
        found[np.arange(len(self.driver)), self.driver] = self.multiplier
        return found

    def positions(self, q: Array) -> Array:
        """Of all joints (..., m) from q (..., n)."""
        return np.asarray(q[..., self.driver] * self.multiplier + self.offset)

    def rates(self, v: Array) -> Array:
        """Speeds or accelerations of all joints (..., m) from those of q (..., n)."""
        return np.asarray(v[..., self.driver] * self.multiplier)

    def gathered(self, x: Array) -> Array:
        """Torques, or derivatives by the joints, (..., n) from those of all joints (..., m)."""
        return np.asarray(x @ self.matrix)
