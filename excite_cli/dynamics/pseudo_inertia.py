"""The 4×4 pseudo-inertia of a body, the nearest real inertias, and what the URDF's are worth.

    J = [[Σ, h], [hᵀ, m]],   h = m c,   Σ = ½ tr(I) 1 − I   (Wensing, Kim & Slotine 2018)

J is linear in the ten standard parameters. Its rows are scaled by the body's length so that all of
it is in kg: D J D with D = diag(1/ℓ, 1/ℓ, 1/ℓ, 1), a congruence, keeps the sign of eigenvalues.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.sparse import csc_matrix, eye

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.robot.link_frame import leaves
from excite_cli.robot.model import Array, Robot

_INERTIA_AT = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # Ixx Ixy Iyy Ixz Iyz Izz
_SHORTEST = 0.02  # m


def _basis() -> Array:
    """∂J/∂φ (10, 4, 4)."""
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1.0
    for axis in range(3):
        basis[1 + axis, axis, 3] = basis[1 + axis, 3, axis] = 1.0
    for k, (row, column) in enumerate(_INERTIA_AT):
        inertia = np.zeros((3, 3))
        inertia[row, column] = inertia[column, row] = 1.0
        basis[4 + k, :3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return basis


BASIS = _basis()


def pseudo_inertias(phi: Array) -> Array:
    """J (bodies, 4, 4) of standard parameters φ (10·bodies,)."""
    return np.einsum("bi,ijk->bjk", phi.reshape(-1, 10), BASIS)


def ten_parameters(pseudo: Array) -> Array:
    """Ten standard parameters of J (4, 4)."""
    second = pseudo[:3, :3]
    inertia = np.trace(second) * np.eye(3) - second
    at = [inertia[row, column] for row, column in _INERTIA_AT]
    return np.array([pseudo[3, 3], *pseudo[:3, 3], *at])


def moved(rotation: Array, translation: Array) -> Array:
    """Matrix (10, 10) that turns standard parameters about a frame into those about another.

    The other stands there at `rotation` (3, 3) and `translation` (3,) [m].
    """
    change = np.eye(4)
    change[:3, :3], change[:3, 3] = rotation.T, -rotation.T @ translation
    return np.stack([ten_parameters(change @ one @ change.T) for one in BASIS], axis=1)


def scaled_basis(length: float) -> Array:
    """∂(D J D)/∂φ (10, 4, 4) of a body of this length [m]."""
    d = np.array([1.0 / length] * 3 + [1.0])
    return BASIS * np.outer(d, d)


def smallest_eigenvalues(phi: Array, lengths: Array) -> Array:
    """Least eigenvalue [kg] of every body's scaled pseudo-inertia; negative: not a body."""
    d = np.column_stack([1.0 / lengths, 1.0 / lengths, 1.0 / lengths, np.ones(len(lengths))])
    scaled = pseudo_inertias(phi) * d[:, :, None] * d[:, None, :]
    return np.asarray(np.linalg.eigvalsh(scaled)[:, 0])


def body_lengths(robot: Robot, phi: Array) -> Array:
    """A length [m] per body: the largest of radius of gyration, lever of its mass, half its reach.

    The reach is the distance to the joints that the body carries.
    """
    bodies = np.asarray(phi, dtype=float).reshape(-1, 10)
    mass = np.maximum(np.abs(bodies[:, 0]), 1e-9)
    lever = np.linalg.norm(bodies[:, 1:4], axis=1) / mass
    trace = np.abs(bodies[:, 4]) + np.abs(bodies[:, 6]) + np.abs(bodies[:, 9])
    gyration = np.sqrt(trace / 2.0 / mass)
    reach = np.zeros(len(bodies))
    model = robot.model
    for joint in range(1, model.njoints):
        parent = int(model.parents[joint])
        if parent > 0:
            distance = float(np.linalg.norm(model.jointPlacements[joint].translation))
            reach[parent - 1] = max(reach[parent - 1], distance / 2.0)
    massive = bodies[:, 0] > 1e-6
    lever, gyration = np.where(massive, lever, 0.0), np.where(massive, gyration, 0.0)
    typical = float(np.median(reach[reach > 0])) if (reach > 0).any() else 0.1
    found = np.maximum.reduce([lever, gyration, reach])
    return np.maximum(np.where(found > 0, found, typical), _SHORTEST)


# The nearest parameters that some bodies have: least squares within the cones of real inertias.
#
#     minimise ‖w‖²  subject to  x = start + back w,  D J(φ_b) D ⪰ margin for every body b of x,
#                                x_k ≥ 0 for some k
#
# With back backᵀ the covariance of `start`, ‖w‖² is the χ² distance between the two. A
# semidefinite program (Sousa & Cortesão 2014; Wensing, Kim & Slotine 2018), solved by Clarabel.

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


# What the URDF's inertias are worth: φ ~ N(φ_CAD, (uncertainty · scale)²) per standard parameter.
#
# Scales are |value| with floors made of the body's mass m and length ℓ (m, m ℓ and m ℓ² with
# factors), so that entries that are zero in the URDF may move a little, and those of bodies
# without inertia as well. Data depend on φ through φ_B = mapping φ only, so the prior acts on
# base parameters as N(mapping φ_CAD, mapping Σ mappingᵀ), and the full φ that goes with a fitted
# φ_B is the conditional mean, the smallest whitened change of φ_CAD.

# Floors: of m in shares of the mean mass, of the others in shares of m ℓ and m ℓ².
_MASS_SHARE, _MOMENT_FLOOR, _INERTIA_FLOOR = 0.1, 0.2, 0.1
_MEDIAN = 0.6745  # of |z|, z normal
_AS_USUAL = 1.05
# A UR10 whose URDF is right but for 30 % stays below 1.6, with a body of thrice the mass at its end
# it has 3 to 5, with 3.5 kg that the URDF lacks 29.
_TOOL = 3.0
_ACTS = 0.1  # of a base parameter's deviation: a body that says less of it does not act on it
# Standard deviation of the URDF's inertial parameters, as a share, where nobody says it: over real
# and simulated robots 0.3 is best or next to it (docs/decisions/prior-of-inertial-parameters.md).
UNSURE = 0.3


@dataclass(frozen=True)
class InertialPrior:
    """`mean` (P,), `std` (P,) of independent standard parameters [kg, kg m, kg m²].

    `ends`: bodies that carry no other.
    """

    mean: Array
    std: Array
    ends: tuple[int, ...] = ()

    def widened(self, base: BaseParameters, values: Array) -> "InertialPrior":
        """The same, as wide as the usual one of its differences from `values` (r,) of a fit.

        Masses of a placeholder are off by many times their size, all of them. A model that lacks
        something is far off in a few directions, and the median does not know these. The last
        bodies may hold a tool. They have a width of their own where it is `_TOOL` times the usual
        one: the RMS of the differences in the directions in which the body's parameters act.
        """
        whiten, target = self.on_base(base)
        off = whiten @ values - target
        usual = max(float(np.median(np.abs(off))) / _MEDIAN, 1.0)
        std = usual * self.std
        for end in self.ends:
            own = slice(10 * end, 10 * end + 10)
            axes, sizes, _ = np.linalg.svd(whiten @ (base.mapping[:, own] * self.std[own]))
            along = axes[:, : len(sizes)][:, sizes > _ACTS].T @ off
            size = float(np.linalg.norm(along)) / np.sqrt(max(len(along), 1)) / usual
            std[own] *= size if size > _TOOL else 1.0
        if (std <= _AS_USUAL * self.std).all():
            return self
        return replace(self, std=std)

    def base_std(self, base: BaseParameters) -> Array:
        """Standard deviations (r,) of base parameters."""
        return np.sqrt(np.square(base.mapping) @ np.square(self.std))

    def rows(self, base: BaseParameters, more: int = 0) -> Array:
        """`on_base` as rows [A b] (r, r + more + 1), zero for `more` other parameters."""
        whiten, target = self.on_base(base)
        return np.column_stack([whiten, np.zeros((len(whiten), more)), target])

    def on_base(self, base: BaseParameters) -> tuple[Array, Array]:
        """Pseudo-rows (A (r, r), b (r,)) with ‖A φ_B − b‖² the prior on base parameters."""
        covariance = (base.mapping * np.square(self.std)) @ base.mapping.T
        lower = np.linalg.cholesky(_regular(covariance))
        a = solve_triangular(lower, np.eye(len(lower)), lower=True)
        return a, a @ (base.mapping @ self.mean)

    def completed(self, base: BaseParameters, values: Array) -> Array:
        """Full φ (P,) with mapping φ = `values` (r,), nearest to the prior's mean."""
        spread = np.square(self.std)[:, None] * base.mapping.T
        covariance = base.mapping @ spread
        gap = values - base.mapping @ self.mean
        phi = self.mean + spread @ cho_solve(cho_factor(_regular(covariance)), gap)
        return phi + _exact(base, values - base.mapping @ phi)


def inertial_prior(robot: Robot, phi_cad: Array, uncertainty: float) -> InertialPrior:
    """The prior of all standard parameters around `phi_cad` (P,), `uncertainty` as a share."""
    bodies = np.asarray(phi_cad, dtype=float).reshape(-1, 10)
    mass, length = np.abs(bodies[:, 0]), body_lengths(robot, phi_cad)
    mass = np.maximum(mass, _MASS_SHARE * max(float(mass.mean()), 1e-6))
    floors = np.empty_like(bodies)
    floors[:, 0] = mass
    floors[:, 1:4] = (_MOMENT_FLOOR * mass * length)[:, None]
    floors[:, 4:] = (_INERTIA_FLOOR * mass * length**2)[:, None]
    scale = np.maximum(np.abs(bodies), floors)
    return InertialPrior(bodies.ravel().copy(), uncertainty * scale.ravel(), tuple(leaves(robot)))


def _regular(covariance: Array) -> Array:
    """With a trace of diagonal, against rounding."""
    return covariance + 1e-13 * np.diag(np.diag(covariance))


def _exact(base: BaseParameters, gap: Array) -> Array:
    """Rounding of the solve, put on the columns that stand for the base parameters."""
    correction = np.zeros(base.mapping.shape[1])
    correction[base.selection] = gap
    return correction
