"""Cost and gradient of a motion: criterion of [C_0; Y_B] and its derivative (Eqs. 41–49).

With CᵀC = V diag(σ²) Vᵀ, u_k = C v_k / σ_k. So with w = ∂f/∂σ the derivative with respect to the
block of this motion is Y_B V diag(w/σ) Vᵀ: only V is needed, and earlier data enter through their
triangular factor alone. The spectrum comes from the Gram matrix where that is exact enough (its
rounding is ε cond²) and from QR and SVD elsewhere.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack, qr

from excite_cli.criteria.base import Criterion, condition_number, singular_values
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.weighting import Weighting
from excite_cli.robot.adjoint import FictitiousInertiaAdjoint
from excite_cli.robot.base_parameters import BaseParameters
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.regressor import Regressor
from excite_cli.robot.spatial_adjoint import SpatialAdjoint
from excite_cli.trajectory.base import Basis

# Beyond this condition number the Gram matrix loses more than 1e-10 and QR + SVD take over.
GRAM_LIMIT = 1e3
# More pairs than this and the batched pull-back is faster than one pass per pair.
FEW_PAIRS = 5
_NEGLIGIBLE = 1e-12


@dataclass(frozen=True)
class Spectrum:
    """Singular values (r,) in descending order and right singular vectors (r, r) as columns."""

    sigma: Array
    right: Array

    @property
    def condition_number(self) -> float:
        """σ_max / σ_min."""
        return condition_number(self.sigma)


class Objective:
    """Criterion of one motion on top of a stack; not to be shared between threads."""

    def __init__(
        self,
        robot: Robot,
        base: BaseParameters,
        weighting: Weighting,
        basis: Basis,
        stack: Stack | None = None,
    ) -> None:
        self.robot, self.base, self.weighting, self.basis = robot, base, weighting, basis
        self.stack = stack or Stack.empty(base.rank)
        self._gram_0 = self.stack.factor.T @ self.stack.factor
        self._regressor = Regressor(robot)
        self._few = FictitiousInertiaAdjoint(robot, base.silent_direction())
        self._many = SpatialAdjoint(robot)
        self._plain = weighting.plain

    def block(self, coefficients: Array) -> Array:
        """Weighted base regressor of this motion alone, (T·R, r)."""
        return self._block(*self.basis.states(coefficients))

    def _block(self, q: Array, v: Array, a: Array) -> Array:
        y = self._regressor.evaluate(q, v, a)[:, :, self.base.selection]
        if not self._plain:
            y = y * self.weighting.rows[:, None] * self.weighting.columns
        return y.reshape(-1, self.base.rank)

    def spectrum(self, block: Array) -> Spectrum:
        """Singular values and right vectors of [C_0; block]."""
        gram = block.T @ block
        gram += self._gram_0
        squares, right, info = lapack.dsyevd(gram)
        if info == 0 and squares[0] > squares[-1] / GRAM_LIMIT**2:
            return Spectrum(np.sqrt(squares[::-1]), right[:, ::-1])
        triangle = qr(np.vstack([self.stack.factor, block]), mode="r")[0][: block.shape[1]]
        _, sigma, turned = np.linalg.svd(triangle)
        return Spectrum(sigma, turned.T)

    def own_condition_number(self, coefficients: Array) -> float:
        """Condition number of this motion alone, cond(C^(i)) of Table I."""
        return condition_number(singular_values(self.block(coefficients)))

    def stacked_condition_number(self, coefficients: Array) -> float:
        """Condition number with all earlier data, cond(C) of Table I."""
        return self.spectrum(self.block(coefficients)).condition_number

    def value(self, coefficients: Array, criterion: Criterion) -> float:
        """Criterion alone."""
        return criterion.value(self.spectrum(self.block(coefficients)).sigma)

    def value_and_gradient(
        self, coefficients: Array, criterion: Criterion
    ) -> tuple[float, Array, Spectrum]:
        """Criterion, its derivative (K, n) with respect to the coefficients, and the spectrum."""
        q, v, a = self.basis.states(coefficients)
        block = self._block(q, v, a)
        spectrum = self.spectrum(block)
        left, right = self.pairs(block, spectrum, criterion)
        adjoint = self._few if len(right) <= FEW_PAIRS else self._many
        gradient = self.basis.pull_back(*adjoint.pull_back(q, v, a, left, right))
        return criterion.value(spectrum.sigma), gradient, spectrum

    def pairs(self, block: Array, spectrum: Spectrum, criterion: Criterion) -> tuple[Array, Array]:
        """Factors of ∂f/∂Y: left (K, T, R) and fictitious parameters (K, 10·n_bodies).

        ∂f/∂Y_t = Σ_k left_kt right_kᵀ (Eq. 45), without the pairs whose weight is negligible.
        """
        weight = criterion.derivative(spectrum.sigma)
        kept = np.flatnonzero(np.abs(weight) > _NEGLIGIBLE * np.abs(weight).max())
        shape = (len(self.basis.times), len(self.robot.rows))
        vectors = spectrum.right[:, kept]
        left = (block @ (vectors * (weight[kept] / spectrum.sigma[kept]))).T
        left = left.reshape(len(kept), *shape) * self.weighting.rows
        right = np.zeros((len(kept), len(self.base.names)))
        right[:, self.base.selection] = (vectors * self.weighting.columns[:, None]).T
        return left, right
