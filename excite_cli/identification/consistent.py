"""Physically consistent full parameters: every body some mass distribution, friction ≥ 0.

    minimise  ‖R [mapping φ; θ] − z‖² + ‖(φ − φ_CAD)/std‖²
    subject to  D J(φ_b) D ⪰ ε for every body b,  θ_k ≥ 0 where it cannot be negative

R, z are the triangular factor of the regression in units of its noise, the second term is the
prior. Unknowns are scaled by the prior, then turned by the factor T of the whole least-squares
term, w = T u − d, so that the objective is ‖w‖² and its minimum without constraints is w = 0.
That is `nearest_inertias`.

Where nobody says what the URDF is worth, the prior is so wide that it decides nothing that the data
show. What they hardly show is then left to the noise and to the errors of the model, which pull
weak directions far away. So the prior is narrowed as long as the misfit of the data stays what it
was:

    ‖R x − z‖² ≤ ‖R x₁ − z‖² + 9

with x₁ the fit with the prior as it was given: no worse than by three standard deviations of
independent noise. First all deviations are multiplied by s, in steps; the misfit only grows as s
falls, hence the first step that is too much ends this. Then links that still differ much are held
one by one, the farthest first, wholly or, where the data do not let that be, in their mass.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import InertialPrior, nearest_inertias, smallest_eigenvalues
from excite_cli.fields import shape
from excite_cli.identification.factors import Mask, triangle_of
from excite_cli.robot.model import Array

# Least eigenvalue required, as a share of the mean mass of a body.
_MARGIN = 1e-6
_SPREADS = (0.7, 0.5, 0.35, 0.25, 0.18, 0.13, 0.1, 0.07, 0.05)
CLEARLY_WORSE = 9.0
# A link is held with this share of the prior's deviations if a parameter is off by more than `_FAR`
# of them, or its mass of itself; so many links at most, as every trial is a program to solve.
_HELD, _FAR, _TRIALS = 0.25, 0.5, 12


@dataclass(frozen=True)
class ConsistentParameters:
    """`phi` (P,) and `effects` (k,), `eigenvalues` (bodies,) [kg] of the scaled pseudo-inertias.

    `cost` ‖R x − z‖² beyond its minimum without constraints and prior, in units of the noise;
    `status` of the solver, a sentence where it did not succeed. `spread`: the deviations of the
    prior as a share of what they were given as (`consistent_near_prior`).
    """

    phi: Annotated[Array, shape("P", finite=True)]
    effects: Annotated[Array, shape("e", finite=True)]
    eigenvalues: Annotated[Array, shape("bodies", finite=True)]
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
    k, count = triangle.shape[1] - base.rank, len(prior.mean)
    norms = np.linalg.norm(triangle[:, base.rank :], axis=0)
    scale = np.append(prior.std, 1.0 / np.where(norms > 0, norms, 1.0))
    center = np.append(prior.mean, np.zeros(k))
    mapping = block_diag(base.mapping, np.eye(k))
    # Effects that nothing shows stay small.
    of_prior = np.diag(np.append(np.ones(count), np.full(k, 1e-6)))
    rows = np.vstack([triangle @ (mapping * scale), of_prior])
    target = np.append(right - triangle @ (mapping @ center), np.zeros(count + k))
    turned = triangle_of(np.column_stack([rows, target]))
    back = solve_triangular(turned[:-1, :-1], np.eye(count + k)) * scale[:, None]
    return center + back @ turned[:-1, -1], back


def consistent_near_prior(
    factor: Array,
    base: BaseParameters,
    prior: InertialPrior,
    lengths: Array,
    nonnegative: Mask,
) -> ConsistentParameters:
    """The set nearest to the prior's mean that the data allow; as `consistent_parameters`.

    `spread` of it is the s of the module's text.
    """
    found = consistent_parameters(factor, base, prior, lengths, nonnegative)
    if not found.solved:
        return found
    allowed = found.cost + CLEARLY_WORSE

    def narrowed(shares: Array) -> ConsistentParameters | None:
        nearer_prior = replace(prior, std=shares * prior.std)
        tried = consistent_parameters(factor, base, nearer_prior, lengths, nonnegative)
        return tried if tried.solved and tried.cost <= allowed else None

    shares = np.ones(len(prior.std))
    for spread in _SPREADS:
        nearer = narrowed(np.full(len(shares), spread))
        if nearer is None:
            break
        found = replace(nearer, spread=spread)
        shares[:] = spread
    # Deviations of light links are several times their mass.
    light = np.clip(prior.mean[::10] / prior.std[::10], 0.1, 1.0)
    untried = set(range(len(lengths))) if shares[0] > _HELD else set()
    for _ in range(_TRIALS):
        body = _farthest(found.phi, prior, untried)
        if body is None:
            break
        untried.remove(body)
        for width in (10, 1):  # all of the link, or its mass
            trial = shares.copy()
            trial[10 * body : 10 * body + width] = _HELD
            trial[10 * body] = _HELD * light[body]
            nearer = narrowed(trial)
            if nearer is not None:
                found, shares = replace(nearer, spread=found.spread), trial
                break
    return found


def _farthest(phi: Array, prior: InertialPrior, bodies: set[int]) -> int | None:
    """The one of `bodies` that is farthest from the prior's mean; None if all are near."""
    change = np.abs(phi - prior.mean).reshape(-1, 10)
    mass = prior.mean[::10]
    relative = np.where(mass > 0, change[:, 0] / np.where(mass > 0, mass, 1.0), 0.0)
    off = np.maximum((change / prior.std.reshape(-1, 10)).max(axis=1), relative)
    far = [body for body in bodies if off[body] > _FAR]
    return max(far, key=lambda body: float(off[body])) if far else None
