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
    """Triangular factor R (r, r) of all earlier regressors and the number of their rows.

    `plain`: where R has other rows and columns, that of the base regressors of planned motions as
    they are, so that condition numbers can be compared with those of other criteria.
    """

    factor: Array
    rows: int = 0
    plain: Array | None = None

    @classmethod
    def empty(cls, rank: int) -> "Stack":
        """No earlier data."""
        return cls(np.zeros((rank, rank)), 0)

    def with_rows(self, block: Array, plain: Array | None = None) -> "Stack":
        """The stack with the rows of `block` (m, r) below, and `plain` below those as they are."""
        below = self.plain if plain is None else _triangle(self.plain, plain)
        return Stack(_triangle(self.factor, block), self.rows + len(block), below)

    def with_stack(self, other: "Stack") -> "Stack":
        """The stack with all that `other` holds."""
        both = self.with_rows(other.factor, other.plain)
        return Stack(both.factor, self.rows + other.rows, both.plain)


def _triangle(above: Array | None, below: Array) -> Array:
    """R (r, r) of the rows of both."""
    rows, rank = below if above is None else np.vstack([above, below]), below.shape[1]
    found = np.asarray(qr(rows, mode="r")[0][:rank])
    return np.ascontiguousarray(np.vstack([found, np.zeros((rank - len(found), rank))]))
