"""Physically consistent full parameters: every body some mass distribution, friction ≥ 0.

    minimise  ‖R [mapping φ; θ] − z‖² + ‖(φ − φ_CAD)/std‖²
    subject to  D J(φ_b) D ⪰ ε for every body b,  θ_k ≥ 0 where it cannot be negative

R, z are the triangular factor of the regression in units of its noise, the second term is the
prior. Unknowns are scaled by the prior, then turned by the factor T of the whole least-squares
term, w = T u − d, so that the objective is ‖w‖² and its minimum without constraints is w = 0.
Solved as a semidefinite program (Sousa & Cortesão 2014; Wensing, Kim & Slotine 2018) by Clarabel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.sparse import csc_matrix, eye

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.identification.factors import Mask, triangle_of
from excite_cli.identification.prior import InertialPrior
from excite_cli.identification.pseudo_inertia import scaled_basis, smallest_eigenvalues
from excite_cli.robot.model import Array

# Least eigenvalue required, as a share of the mean mass of a body.
_MARGIN = 1e-6
_ROOT2 = float(np.sqrt(2.0))


@dataclass(frozen=True)
class ConsistentParameters:
    """`phi` (P,) and `effects` (k,), `eigenvalues` (bodies,) [kg] of the scaled pseudo-inertias.

    `cost` ‖R x − z‖² beyond its minimum without constraints and prior, in units of the noise;
    `status` of the solver, a sentence where it did not succeed.
    """

    phi: Array
    effects: Array
    eigenvalues: Array
    cost: float
    status: str
    solved: bool


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
    r, k = base.rank, len(nonnegative)
    triangle, right = factor[:-1, :-1], factor[:-1, -1]
    count = len(prior.mean)
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
    x, status, solved = _solve(turned, d, scale, center, lengths, nonnegative)
    free = np.linalg.lstsq(triangle, right, rcond=None)[0]
    at = np.concatenate([base.mapping @ x[:count], x[count:]])
    missed = [np.square(triangle @ point - right).sum() for point in (at, free)]
    return ConsistentParameters(
        phi=x[:count],
        effects=x[count:],
        eigenvalues=smallest_eigenvalues(x[:count], lengths),
        cost=float(missed[0] - missed[1]),
        status=status,
        solved=solved,
    )


def _effect_scale(columns: Array) -> Array:
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > 0, 1.0 / np.where(norms > 0, norms, 1.0), 1.0)


def _turned(objective: Array, target: Array) -> tuple[Array, Array]:
    """T and d with ‖objective u − target‖² = ‖T u − d‖² + constant."""
    triangle = triangle_of(np.column_stack([objective, target]))
    size = objective.shape[1]
    return triangle[:size, :size], triangle[:size, size]


def _solve(
    turned: Array, d: Array, scale: Array, center: Array, lengths: Array, nonnegative: Mask
) -> tuple[Array, str, bool]:
    """x = center + scale ∘ T⁻¹(w + d), w of least norm within the cones."""
    size, k, bodies = len(scale), len(nonnegative), len(lengths)
    back = solve_triangular(turned, np.eye(size)) * scale[:, None]
    start = center + back @ d
    margin = _MARGIN * max(float(np.abs(center[: 10 * bodies : 10]).mean()), 1e-6)
    signs = np.flatnonzero(nonnegative) + 10 * bodies
    if not _broken(start, lengths, signs, margin, 10 * bodies):
        return start, "no constraint is active", True
    rows = [-_unit(back[signs])[0]]
    bounds = [start[signs] * _unit(back[signs])[1]]
    for b in range(bodies):
        of_body = slice(10 * b, 10 * b + 10)
        vector = _triangle_vectors(scaled_basis(lengths[b]))
        rows.append(-vector.T @ back[of_body])
        bounds.append(vector.T @ start[of_body] - margin * _triangle_vectors(np.eye(4)[None])[0])
    import clarabel

    cones: list[object] = [clarabel.NonnegativeConeT(len(signs))] if len(signs) else []
    cones += [clarabel.PSDTriangleConeT(4)] * bodies
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = 200
    solver = clarabel.DefaultSolver(
        csc_matrix(eye(size)),
        np.zeros(size),
        csc_matrix(np.vstack(rows)),
        np.concatenate(bounds),
        cones,
        settings,
    )
    found = solver.solve()
    status = str(found.status)
    x = start + back @ np.asarray(found.x)
    if k:  # a zero is a zero, not -1e-12
        x[signs] = np.maximum(x[signs], 0.0)
    solved = status in ("Solved", "AlmostSolved")
    eigenvalues = smallest_eigenvalues(x[: 10 * bodies], lengths)
    if solved and eigenvalues.min() <= 0:
        return x, f"{status}, but a body is left with a negative eigenvalue", False
    return x, status, solved


def _broken(x: Array, lengths: Array, signs: NDArray[np.intp], margin: float, count: int) -> bool:
    if (x[signs] < 0).any():
        return True
    return bool(smallest_eigenvalues(x[:count], lengths).min() < margin)


def _unit(rows: Array) -> tuple[Array, Array]:
    """Rows of unit norm, and what they were divided by, inverted."""
    norms = np.linalg.norm(rows, axis=1)
    factor = 1.0 / np.where(norms > 0, norms, 1.0)
    return rows * factor[:, None], factor


def _triangle_vectors(matrices: Array) -> Array:
    """Upper triangles (…, 10) column by column, off-diagonal entries times √2."""
    columns, rows = np.tril_indices(4)
    return matrices[..., rows, columns] * np.where(rows == columns, 1.0, _ROOT2)
