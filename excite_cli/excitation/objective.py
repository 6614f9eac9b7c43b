"""Cost and gradient of a motion: criterion of [C_0; C] and its derivative (Eqs. 41–49).

C is the base regressor Y_B, with columns of effects beside it if there are any. With
CᵀC = V diag(σ²) Vᵀ, u_k = C v_k / σ_k. So with w = ∂f/∂σ the derivative with respect to the block
of this motion is C V diag(w/σ) Vᵀ: only V is needed, and earlier data enter through their
triangular factor alone. The spectrum comes from the Gram matrix where that is exact enough (its
rounding is ε cond²) and from QR and SVD elsewhere.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack, qr

from excite_cli.criteria.base import Criterion, condition_number, singular_values
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.spatial_adjoint import FictitiousInertiaAdjoint, SpatialAdjoint
from excite_cli.excitation.effect_columns import Extension, SeenColumns
from excite_cli.excitation.progress import Figure, ProgressMeasure
from excite_cli.excitation.weighting import Weighting
from excite_cli.kernels.compiled import KERNELS
from excite_cli.robot.model import Array, Robot
from excite_cli.trajectory.base import Basis

# The earlier data C_0 of Eq. 41, kept as a triangular factor.
#
# Only C_0ᵀC_0 matters, so the stack is R with RᵀR = C_0ᵀC_0, (r, r), updated by one QR per
# motion: the cost of motion 50 is that of motion 2.


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


# Beyond this condition number the Gram matrix loses more than 1e-10 and QR + SVD take over.
GRAM_LIMIT = 1e3
# Uncompiled, with more pairs than this the batched product is faster than one pass per pair.
FEW_PAIRS = 5
_NEGLIGIBLE = 1e-12


@dataclass(frozen=True)
class Spectrum:
    """Singular values (r,) in descending order and right singular vectors (r, r) as columns.

    `of_torques`: they are of C T, and `right` is T V: C right = U diag(σ) there as well.
    """

    sigma: Array
    right: Array
    of_torques: bool = False

    @property
    def condition_number(self) -> float:
        """σ_max / σ_min."""
        return condition_number(self.sigma)

    @property
    def figure(self) -> Figure:
        """What a solver improves."""
        if self.of_torques:
            return Figure(
                ProgressMeasure.TORQUE_DEVIATION, float(np.sqrt(np.sum(self.sigma**-2.0)))
            )
        return Figure(ProgressMeasure.CONDITION_NUMBER, self.condition_number)


@dataclass(frozen=True)
class Evaluation:
    """The criterion of a motion, its spectrum, and on demand its derivative (K, n)."""

    value: float
    spectrum: Spectrum
    gradient: Callable[[], Array]


class Objective:
    """Criterion of one motion on top of a stack; not to be shared between threads."""

    # Whether a motion is refused when some parameter does not show in the stack at all.
    must_show_all = True

    def __init__(
        self,
        robot: Robot,
        base: BaseParameters,
        weighting: Weighting,
        basis: Basis,
        stack: Stack | None = None,
        extension: Extension | None = None,
        metric: Array | None = None,
    ) -> None:
        self.metric = metric
        self.robot, self.base, self.weighting, self.basis = robot, base, weighting, basis
        self.extension = extension if extension is not None and extension.effects else None
        self._effects = self.extension.columns() if self.extension else None
        self.size = base.rank + (self._effects.count if self._effects else 0)
        self.stack = stack or Stack.empty(self.size)
        self._gram_0 = self.stack.factor.T @ self.stack.factor
        self._regressor = Regressor(robot)
        self._few = FictitiousInertiaAdjoint(robot, base.silent_direction())
        self._many = SpatialAdjoint(robot)
        self._plain = weighting.plain
        # Every moved joint is measured: then torques and their derivatives are those of the rows.
        self._whole = np.array_equal(robot.rows, robot.moved)

    def block(self, coefficients: Array) -> Array:
        """Weighted and scaled columns of this motion alone, (T·R, r)."""
        return self.block_of(self.basis.times, *self.basis.states(coefficients))

    def block_of(self, times: Array, q: Array, v: Array, a: Array) -> Array:
        """Weighted and scaled columns (T·R, r) of states (T, n) at equidistant `times`."""
        return self._evaluated(times, q, v, a)[0]

    def added_to(self, stack: Stack, coefficients: Array) -> Stack:
        """`stack` with the rows of this motion."""
        return stack.with_rows(self.block(coefficients))

    def _evaluated(
        self, times: Array, q: Array, v: Array, a: Array
    ) -> tuple[Array, SeenColumns | None]:
        """Weighted and scaled columns (T·R, r), and those of effects as they are."""
        if KERNELS is not None:
            y = self._many.regressor(q, v, a, self.base.selection)
        else:
            y = self._regressor.evaluate(q, v, a)[:, :, self.base.selection]
        seen = None
        if self._effects is not None:
            values = self.base.mapping @ self._effects.phi
            load = y @ values if self._whole else None
            seen = self._effects.evaluate(times, q, v, a, load)
        if not self._plain:
            y = y * self.weighting.rows[:, None] * self.weighting.columns
        if seen is not None:
            y = np.concatenate([y, seen.columns * self._effect_weights()], axis=2)
        return y.reshape(-1, self.size), seen

    def _effect_weights(self) -> Array:
        """Row weight times column scale, (R, k), of the columns of effects."""
        assert self.extension is not None
        return np.outer(self.weighting.rows, self.extension.scales)

    def spectrum(self, block: Array) -> Spectrum:
        """Singular values and right vectors of [C_0; block], combined by the metric if any."""
        if self.metric is None:
            return self._spectrum(block.T @ block + self._gram_0, block)
        gram = self.metric.T @ (block.T @ block + self._gram_0) @ self.metric
        found = self._spectrum(gram, block, self.metric)
        return Spectrum(found.sigma, self.metric @ found.right, of_torques=True)

    def _spectrum(self, gram: Array, block: Array, metric: Array | None = None) -> Spectrum:
        squares, right, info = lapack.dsyevd(gram)
        if info == 0 and squares[0] > squares[-1] / GRAM_LIMIT**2:
            return Spectrum(np.sqrt(squares[::-1]), right[:, ::-1])
        rows = np.vstack([self.stack.factor, block])
        rows = rows if metric is None else rows @ metric
        triangle = qr(rows, mode="r")[0][: block.shape[1]]
        _, sigma, turned = np.linalg.svd(triangle)
        return Spectrum(sigma, turned.T)

    def earlier(self) -> Array:
        """What the criterion is a function of, for the earlier data alone."""
        factor = self.stack.factor
        return singular_values(factor if self.metric is None else factor @ self.metric)

    def own_condition_number(self, coefficients: Array) -> float:
        """Condition number of this motion alone, cond(C^(i)) of Table I."""
        return condition_number(singular_values(self.block(coefficients)))

    def stacked_condition_number(self, coefficients: Array) -> float:
        """Condition number with all earlier data, cond(C) of Table I."""
        block = self.block(coefficients)
        return self._spectrum(block.T @ block + self._gram_0, block).condition_number

    def figures_of(self, grams: Array) -> Array:
        """What random motions are chosen by (N,): condition numbers, of Gram matrices (N, r, r)."""
        squares = np.linalg.eigvalsh(grams)
        return np.asarray(np.sqrt(squares[:, -1] / np.maximum(squares[:, 0], 1e-300)))

    def deviation_with(self, stack: Stack) -> float | None:
        """Predicted deviation after the data in `stack`, where motions are planned for that."""
        return None

    def value(self, coefficients: Array, criterion: Criterion) -> float:
        """Criterion alone."""
        return criterion.value(self.spectrum(self.block(coefficients)).sigma)

    def evaluation(self, coefficients: Array, criterion: Criterion) -> Evaluation:
        """Criterion and spectrum, and what it takes to get the derivative."""
        q, v, a = self.basis.states(coefficients)
        block, seen = self._evaluated(self.basis.times, q, v, a)
        spectrum = self.spectrum(block)

        def gradient() -> Array:
            parts = self._by_states(q, v, a, block, spectrum, criterion, seen)
            return self.basis.pull_back(*parts)

        return Evaluation(criterion.value(spectrum.sigma), spectrum, gradient)

    def value_and_gradient(
        self, coefficients: Array, criterion: Criterion
    ) -> tuple[float, Array, Spectrum]:
        """Criterion, its derivative (K, n) with respect to the coefficients, and the spectrum."""
        found = self.evaluation(coefficients, criterion)
        return found.value, found.gradient(), found.spectrum

    def _by_states(
        self,
        q: Array,
        v: Array,
        a: Array,
        block: Array,
        spectrum: Spectrum,
        criterion: Criterion,
        seen: SeenColumns | None,
    ) -> tuple[Array, Array, Array]:
        """Derivatives (T, n) by q, v, a through the regressor, and through columns of effects."""
        weight = criterion.derivative(spectrum.sigma)
        kept = np.flatnonzero(np.abs(weight) > _NEGLIGIBLE * np.abs(weight).max())
        if KERNELS is None and len(kept) <= FEW_PAIRS and seen is None:
            return self._few.pull_back(q, v, a, *self.pairs(block, spectrum, criterion))
        # ∂f/∂C = C V diag(w/σ) Vᵀ, the product that is cheaper first.
        vectors, rank = spectrum.right[:, kept], self.base.rank
        scaled = vectors * (weight[kept] / spectrum.sigma[kept])
        few = len(kept) < len(vectors) // 2
        by_block = (block @ scaled) @ vectors.T if few else block @ (scaled @ vectors.T)
        by_block = by_block.reshape(len(q), -1, self.size)
        inertial = by_block[:, :, :rank]
        if not self._plain:
            inertial = inertial * self.weighting.rows[:, None] * self.weighting.columns
        weights = np.zeros((*inertial.shape[:2], len(self.base.names)))
        weights[:, :, self.base.selection] = inertial
        if seen is None:
            return self._many.pull_back_dense(q, v, a, weights)
        return self._with_effects(weights, by_block[:, :, rank:] * self._effect_weights(), seen)

    def _with_effects(
        self, weights: Array, by_columns: Array, seen: SeenColumns
    ) -> tuple[Array, Array, Array]:
        """One pass for both: what depends on the torque Y φ depends on the regressor."""
        assert self._effects is not None
        q, v, a = seen.signals.q, seen.signals.v, seen.signals.a
        if not self._whole:
            beside = self._effects.pull_back(seen, by_columns)
            own = self._many.pull_back_dense(q, v, a, weights)
            return own[0] + beside[0], own[1] + beside[1], own[2] + beside[2]
        direct, by_torque, by_regressor = self._effects.cotangents(seen, by_columns)
        weights += by_torque[:, :, None] * self._effects.phi
        if by_regressor is not None:
            weights += by_regressor
        own = self._many.pull_back_dense(q, v, a, weights)
        return own[0] + direct[0], own[1] + direct[1], own[2] + direct[2]

    def effect_gradient(self, coefficients: Array, criterion: Criterion) -> Array:
        """The part (K, n) of the gradient that goes through columns of effects."""
        block, seen = self._evaluated(self.basis.times, *self.basis.states(coefficients))
        if seen is None:
            return np.zeros_like(coefficients)
        return self._through_effects(seen, block, self.spectrum(block), criterion)

    def pairs(self, block: Array, spectrum: Spectrum, criterion: Criterion) -> tuple[Array, Array]:
        """Factors of ∂f/∂Y: left (K, T, R) and fictitious parameters (K, 10·n_bodies).

        ∂f/∂Y_t = Σ_k left_kt right_kᵀ (Eq. 45), without the pairs whose weight is negligible.
        """
        left, vectors = self._factors(block, spectrum, criterion)
        right = np.zeros((len(left), len(self.base.names)))
        inertial = vectors[: self.base.rank]
        right[:, self.base.selection] = (inertial * self.weighting.columns[:, None]).T
        return left * self.weighting.rows, right

    def _factors(
        self, block: Array, spectrum: Spectrum, criterion: Criterion
    ) -> tuple[Array, Array]:
        """Left (K, T, R) and right (r, K) factors of ∂f/∂C."""
        weight = criterion.derivative(spectrum.sigma)
        kept = np.flatnonzero(np.abs(weight) > _NEGLIGIBLE * np.abs(weight).max())
        vectors = spectrum.right[:, kept]
        left = (block @ (vectors * (weight[kept] / spectrum.sigma[kept]))).T
        return left.reshape(len(kept), -1, len(self.robot.rows)), vectors

    def _through_effects(
        self, seen: SeenColumns, block: Array, spectrum: Spectrum, criterion: Criterion
    ) -> Array:
        assert self._effects is not None
        left, vectors = self._factors(block, spectrum, criterion)
        weights = left.transpose(1, 2, 0) @ vectors[self.base.rank :].T
        parts = self._effects.pull_back(seen, weights * self._effect_weights())
        return self.basis.pull_back(*parts)
