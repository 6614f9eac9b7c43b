"""The family of criteria: functions of the singular values of the stacked regressor.

A member gives the value f(σ) that is minimised and its derivative ∂f/∂σ. With Eq. 16 the
derivative with respect to the matrix is Σ_k (∂f/∂σ_k) u_k v_kᵀ, so one adjoint serves them all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from excite_cli.arrays import Array as Array

if TYPE_CHECKING:
    from excite_cli.config.spec import CriterionSpec

# p of the smooth stand-ins of a criterion with corners, one after the other.
SHARPNESS = (4.0, 16.0, 64.0, 256.0, 1024.0)


class Criterion(ABC):
    """Minimised function of the singular values, in descending order."""

    name: str
    of_torques: bool = False
    """Whether σ is of columns combined by the torque that they make at random states."""
    of_work: bool = False
    """Whether these states are of the user's work, and prior knowledge counts as data."""
    restarts: int = 4
    """Starts of a motion where the config gives no number."""
    tolerance: float = 1e-3
    """Change of log f over 8 iterations that ends a start, where the config gives none."""
    compares_columns: bool = False
    """Whether it is about columns beside each other, so that one alone says nothing."""

    @classmethod
    def build(cls, spec: CriterionSpec) -> Criterion:
        """The criterion with what a config says of it."""
        return cls()

    @abstractmethod
    def value(self, sigma: Array) -> float:
        """f(σ) for σ (r,) in descending order."""

    @abstractmethod
    def derivative(self, sigma: Array) -> Array:
        """∂f/∂σ (r,)."""

    def continuation(self) -> tuple[Criterion, ...]:
        """Criteria to minimise one after the other, each a closer stand-in for this one."""
        return (self,)


def singular_values(matrix: Array) -> Array:
    """Singular values of `matrix` (m, r) in descending order."""
    return np.asarray(np.linalg.svd(matrix, compute_uv=False), dtype=float)


def condition_number(sigma: Array) -> float:
    """σ_max / σ_min (Eq. 5); infinite when the matrix has lost rank."""
    return float(sigma[0] / sigma[-1]) if sigma[-1] > 0 else float("inf")
