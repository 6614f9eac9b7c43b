"""The nearest parameters that some bodies have: least squares within the cones of real inertias.

    minimise ‖w‖²  subject to  x = start + back w,  D J(φ_b) D ⪰ margin for every body b of x,
                               x_k ≥ 0 for some k

With back backᵀ the covariance of `start`, ‖w‖² is the χ² distance between the two. A semidefinite
program (Sousa & Cortesão 2014; Wensing, Kim & Slotine 2018), solved by Clarabel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, eye

from excite_cli.dynamics.pseudo_inertia import scaled_basis, smallest_eigenvalues
from excite_cli.robot.model import Array

_FREE = 100.0  # kg, or times the mass of a body: what is as uncertain is free
_ROOT2 = float(np.sqrt(2.0))


@dataclass(frozen=True)
class NearestInertias:
    """`x` (size,), ‖w‖² as `distance`, `status` of the solver, a sentence where it failed."""

    x: Array
    distance: float
    status: str
    solved: bool


def nearest_inertias(
    back: Array, start: Array, lengths: Array, signs: NDArray[np.intp], margin: float
) -> NearestInertias:
    """Solve the program.

    Parameters
    ----------
    back: (size, m)
    start: (size,) standard parameters of the bodies first, then anything else
    lengths: (bodies,) [m]
    signs: entries of x that cannot be negative
    margin: least eigenvalue [kg] of a body's scaled pseudo-inertia
    """
    bodies = len(lengths)
    if not _broken(start, lengths, signs, margin):
        return NearestInertias(start, 0.0, "no constraint is active", True)
    back = _bounded(back, start, lengths)
    rows = [-_unit(back[signs])[0]]
    bounds = [start[signs] * _unit(back[signs])[1]]
    for b in range(bodies):
        of_body = slice(10 * b, 10 * b + 10)
        vector = _triangle_vectors(scaled_basis(lengths[b]))
        rows.append(-vector.T @ back[of_body])
        bounds.append(vector.T @ start[of_body] - margin * _triangle_vectors(np.eye(4)[None])[0])
    w, status = _least_norm(np.vstack(rows), np.concatenate(bounds), len(signs), bodies)
    x = start + back @ w
    x[signs] = np.maximum(x[signs], 0.0)  # a zero is a zero, not -1e-12
    solved = status in ("Solved", "AlmostSolved")
    eigenvalues = smallest_eigenvalues(x[: 10 * bodies], lengths)
    if solved and eigenvalues.min() <= 0:
        status, solved = f"{status}, but a body is left with a negative eigenvalue", False
    return NearestInertias(x, float(w @ w), status, solved)


def _bounded(back: Array, start: Array, lengths: Array) -> Array:
    """`back` with no deviation beyond `_FREE` times the body, of which data say nothing anyway.

    Where they are 1e16 times those that the data know, the solver breaks off: the payload of a
    planar arm was not found for that.
    """
    found = back.copy()
    for b, length in enumerate(lengths):
        of_body = slice(10 * b, 10 * b + 10)
        units = length ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
        most = _FREE * max(1.0, float(np.abs(start[of_body] / units).max())) * units
        spread = np.linalg.norm(back[of_body], axis=1)
        found[of_body] *= np.minimum(1.0, most / np.maximum(spread, 1e-300))[:, None]
    return found


def _least_norm(rows: Array, bounds: Array, signs: int, bodies: int) -> tuple[Array, str]:
    import clarabel

    cones: list[object] = [clarabel.NonnegativeConeT(signs)] if signs else []
    cones += [clarabel.PSDTriangleConeT(4)] * bodies
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = 200
    size = rows.shape[1]
    solver = clarabel.DefaultSolver(
        csc_matrix(eye(size)), np.zeros(size), csc_matrix(rows), bounds, cones, settings
    )
    try:
        found = solver.solve()
    except BaseException as error:
        # A panic of the compiled solver is no `Exception`: what it could not factorise has no
        # nearest body, which is for the caller to say, and not the end of the program.
        if type(error).__name__ != "PanicException":
            raise
        return np.zeros(size), f"the solver broke off: {error}"
    return np.asarray(found.x), str(found.status)


def _broken(x: Array, lengths: Array, signs: NDArray[np.intp], margin: float) -> bool:
    if (x[signs] < 0).any():
        return True
    return bool(smallest_eigenvalues(x[: 10 * len(lengths)], lengths).min() < margin)


def _unit(rows: Array) -> tuple[Array, Array]:
    """Rows of unit norm, and what they were divided by, inverted."""
    norms = np.linalg.norm(rows, axis=1)
    factor = 1.0 / np.where(norms > 0, norms, 1.0)
    return rows * factor[:, None], factor


def _triangle_vectors(matrices: Array) -> Array:
    """Upper triangles (…, 10) column by column, off-diagonal entries times √2."""
    columns, rows = np.tril_indices(4)
    return matrices[..., rows, columns] * np.where(rows == columns, 1.0, _ROOT2)
