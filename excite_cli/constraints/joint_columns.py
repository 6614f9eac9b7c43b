"""What is known of columns that each bound one quantity of one joint."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Quantity(IntEnum):
    """What of a joint is bounded: a derivative of q of that order, or its torque."""

    POSITION = 0
    VELOCITY = 1
    ACCELERATION = 2
    JERK = 3
    TORQUE = 4


@dataclass(frozen=True, eq=False)
class JointColumns:
    """Margin k is bounds[k] − signs[k]·(the quantity of joint joints[k]); all (m,)."""

    quantity: Quantity
    joints: NDArray[np.intp]
    signs: NDArray[np.float64]
    bounds: NDArray[np.float64]

    @property
    def linear(self) -> bool:
        """Whether margins are linear in the coefficients of a motion."""
        return self.quantity <= Quantity.JERK

    def put_into(self, lower: NDArray[np.float64], upper: NDArray[np.float64]) -> None:
        """Write the bounds to their joints (n,) in `lower` and `upper`."""
        low = self.signs < 0
        lower[self.joints[low]] = -self.bounds[low]
        upper[self.joints[~low]] = self.bounds[~low]
