"""Physically consistent full parameters: every body some mass distribution, friction ≥ 0.

    minimise  ‖R [mapping φ; θ] − z‖² + ‖(φ − φ_CAD)/std‖²
    subject to  D J(φ_b) D ⪰ ε for every body b,  θ_k ≥ 0 where it cannot be negative

R, z are the triangular factor of the regression in units of its noise, the second term is the
prior. Unknowns are scaled by the prior, then turned by the factor T of the whole least-squares
term, w = T u − d, so that the objective is ‖w‖² and its minimum without constraints is w = 0.
That is `nearest_inertias`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.nearest_inertias import nearest_inertias
from excite_cli.dynamics.pseudo_inertia import smallest_eigenvalues
from excite_cli.identification.factors import Mask, triangle_of
from excite_cli.identification.prior import InertialPrior
from excite_cli.robot.model import Array

# Least eigenvalue required, as a share of the mean mass of a body.
_MARGIN = 1e-6


@dataclass(frozen=True)
class ConsistentParameters:
    """`phi` (P,) and `effects` (k,), `eigenvalues` (bodies,) [kg] of the scaled pseudo-inertias.

    `cost` ‖R x − z‖² beyond its minimum without constraints and prior, in units of the noise;
    `status` of the solver, a sentence where it did not succeed. `spread`: the deviations of the
    prior as a share of what they were given as (`consistent_spread`).
    """

    phi: Array
    effects: Array
    eigenvalues: Array
    cost: float
    status: str
    solved: bool
    spread: float = 1.0


def consistent_parameters(
    factor: Array,
    base: BaseParameters,
    prior: InertialPrior,
    lengths: Array,
    nonnegative: Mask,
) -> ConsistentParameters:
    """Solve the program.

    Parameters
    ----------
    factor: (p+1, p+1) of [base columns, effects' columns, τ], rows divided by their noise
    lengths: (bodies,) [m]
    nonnegative: (k,) effects' parameters that cannot be negative
    """
    triangle, right = factor[:-1, :-1], factor[:-1, -1]
    count = len(prior.mean)
    start, back = without_constraints(factor, base, prior)
    margin = _MARGIN * max(float(np.abs(prior.mean[::10]).mean()), 1e-6)
    signs = np.flatnonzero(nonnegative) + count
    nearest = nearest_inertias(back, start, lengths, signs, margin)
    x = nearest.x
    unseen = np.flatnonzero(~triangle[:, base.rank :].any(axis=0))
    x[count + unseen] = 0.0  # nothing holds them, and the solver leaves them in its middle
    free = np.linalg.lstsq(triangle, right, rcond=None)[0]
    at = np.concatenate([base.mapping @ x[:count], x[count:]])
    missed = [np.square(triangle @ point - right).sum() for point in (at, free)]
    return ConsistentParameters(
        phi=x[:count],
        effects=x[count:],
        eigenvalues=smallest_eigenvalues(x[:count], lengths),
        cost=float(missed[0] - missed[1]),
        status=nearest.status,
        solved=nearest.solved,
    )


def without_constraints(
    factor: Array, base: BaseParameters, prior: InertialPrior
) -> tuple[Array, Array]:
    """The minimum [φ; θ] (P + k,) without constraints, and B (P + k, P + k).

    B Bᵀ is its covariance, the inverse of the information of `factor` plus that of the prior.
    """
    triangle, right = factor[:-1, :-1], factor[:-1, -1]
    r, count = base.rank, len(prior.mean)
    k = triangle.shape[1] - r
    effect_scale = _effect_scale(triangle[:, r:])
    # Unknowns u: φ = mean + std ∘ u_φ, θ = effect_scale ∘ u_θ.
    of_phi = triangle[:, :r] @ (base.mapping * prior.std)
    objective = np.zeros((len(triangle) + count + k, count + k))
    objective[: len(triangle)] = np.hstack([of_phi, triangle[:, r:] * effect_scale])
    objective[len(triangle) : -k or None, :count] = np.eye(count)
    if k:
        objective[-k:, count:] = 1e-6 * np.eye(k)  # effects that nothing shows stay small
    target = np.zeros(len(objective))
    target[: len(triangle)] = right - triangle[:, :r] @ (base.mapping @ prior.mean)
    turned, d = _turned(objective, target)
    scale = np.concatenate([prior.std, effect_scale])
    center = np.concatenate([prior.mean, np.zeros(k)])
    back = solve_triangular(turned, np.eye(len(scale))) * scale[:, None]
    return center + back @ d, back


def _effect_scale(columns: Array) -> Array:
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > 0, 1.0 / np.where(norms > 0, norms, 1.0), 1.0)


def _turned(objective: Array, target: Array) -> tuple[Array, Array]:
    """T and d with ‖objective u − target‖² = ‖T u − d‖² + constant."""
    triangle = triangle_of(np.column_stack([objective, target]))
    size = objective.shape[1]
    return triangle[:size, :size], triangle[:size, size]
