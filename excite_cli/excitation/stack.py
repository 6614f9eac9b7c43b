"""The earlier data C_0 of Eq. 41, kept as a triangular factor.

Only C_0ᵀC_0 matters, so the stack is R with RᵀR = C_0ᵀC_0, (r, r), updated by one QR per motion:
the cost of motion 50 is that of motion 2.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from excite_cli.robot.model import Array


@dataclass(frozen=True)
class Stack:
    """Triangular factor R (r, r) of all earlier regressors and the number of their rows."""

    factor: Array
    rows: int = 0

    @classmethod
    def empty(cls, rank: int) -> "Stack":
        """No earlier data."""
        return cls(np.zeros((rank, rank)), 0)

    def with_rows(self, block: Array) -> "Stack":
        """The stack with the rows of `block` (m, r) below."""
        factor = qr(np.vstack([self.factor, block]), mode="r")[0][: self.factor.shape[1]]
        return Stack(np.ascontiguousarray(factor), self.rows + len(block))

    def with_stack(self, other: "Stack") -> "Stack":
        """The stack with all that `other` holds."""
        return Stack(self.with_rows(other.factor).factor, self.rows + other.rows)
