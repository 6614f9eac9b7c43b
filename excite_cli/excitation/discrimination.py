"""The motion that tells effects apart: T-optimality (Atkinson and Fedorov 1975).

Suppose effect A with parameters θ_A is the cause. How much would be left over if B were fitted in
its place? With rows weighted by 1/noise, all earlier data as the factor R of [base, model, rivals],
and the columns C of the new motion below,

    Δ_AB = min_x ‖ [R; C] z ‖²,   z = θ_A on the columns of A, −x on base, the other effects and B,

zero elsewhere. ½ Δ is the Kullback–Leibler divergence between the two: what one expects the data to
say for A against B. The motion maximises the smallest of all Δ, both ways of every pair.

By the envelope theorem the optimal x may be held fixed: with σ = √Δ = ‖[R; C] z‖,

    ∂σ/∂C = (C z / σ) zᵀ,

the form of a singular value (u vᵀ with u = C v/σ). So a `Spectrum` of σ = √Δ and z in place of
singular values and vectors is all that the cost, its gradient, the criteria and the solvers need;
the criterion is −log σ_min, by the p-norm with rising p.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve

from excite_cli.arrays import Array, Indices
from excite_cli.excitation.objective import Objective, Spectrum, Stack
from excite_cli.excitation.progress import Figure, ProgressMeasure

# Divergence from which two effects count as told apart.
SEPARATED = 3.0
MOST_MOTIONS = 1000
_RIDGE = 1e-13
_SMALLEST = 1e-150


@dataclass(frozen=True)
class Direction:
    """One way of a pair: `truth` (c,) holds θ on the columns of the true effect, zero elsewhere.

    `free` are the columns that are fitted to it; `pair` names the true effect and its stand-in.
    """

    pair: tuple[str, str]
    truth: Array
    free: Indices


@dataclass(frozen=True)
class Separation:
    """What is to be told apart, on columns [base, model, rivals] that are scaled as the problem's.

    `directions` holds both ways of a pair one after the other; `prior` the earlier data.
    """

    directions: tuple[Direction, ...]
    prior: Stack


class SeparationSpectrum(Spectrum):
    """√Δ of every direction in descending order, and the z of each as columns of `right`."""

    @property
    def figure(self) -> Figure:
        """The smallest divergence."""
        return Figure(ProgressMeasure.DIVERGENCE, 0.5 * float(self.sigma[-1]) ** 2)


def residual_directions(gram: Array, directions: Sequence[Direction]) -> tuple[Array, Array]:
    """Δ (D,) and the optimal z (c, D) of every direction, for the Gram matrix of all rows."""
    z = np.array([direction.truth for direction in directions]).T
    for index, direction in enumerate(directions):
        free = direction.free
        size = np.sqrt(np.maximum(np.diag(gram)[free], _SMALLEST))
        scaled = gram[np.ix_(free, free)] / np.outer(size, size)
        scaled[np.diag_indices_from(scaled)] += _RIDGE
        fitted = solve(scaled, (gram[free] @ direction.truth) / size, assume_a="sym")
        z[free, index] -= fitted / size
    return np.maximum(np.einsum("cd,cd->d", z, gram @ z), _SMALLEST**2), z


def divergences(gram: Array, directions: Sequence[Direction]) -> Array:
    """½ Δ (D,) of every direction."""
    return 0.5 * residual_directions(gram, directions)[0]


def motions_needed(prior: Array, motion: Array, directions: Sequence[Direction]) -> int | None:
    """How many such motions, on top of earlier data, tell all pairs apart; None: too many.

    `prior` and `motion` are Gram matrices; apart means a divergence of `SEPARATED` in every
    direction.
    """

    def apart(count: int) -> bool:
        return bool(divergences(prior + count * motion, directions).min() >= SEPARATED)

    if not apart(MOST_MOTIONS):
        return None
    low, high = 0, MOST_MOTIONS
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if apart(middle) else (middle, high)
    return high


class Discrimination(Objective):
    """Divergences of a `Separation` in place of the singular values; see the module."""

    must_show_all = False

    def __init__(self, *parts: Any, separation: Separation) -> None:
        super().__init__(*parts)
        self.separation = separation

    def spectrum(self, block: Array) -> Spectrum:
        """√Δ and z of every direction, in descending order of Δ."""
        return self._of_gram(block.T @ block + self._gram_0)

    def _of_gram(self, gram: Array) -> Spectrum:
        squares, z = residual_directions(gram, self.separation.directions)
        order = np.argsort(-squares)
        return SeparationSpectrum(np.sqrt(squares[order]), z[:, order])

    def earlier(self) -> Array:
        """√Δ of every direction for the earlier data alone."""
        return self._of_gram(self._gram_0).sigma
