"""The 4×4 pseudo-inertia of a body: positive semidefinite if some mass distribution has it.

    J = [[Σ, h], [hᵀ, m]],   h = m c,   Σ = ½ tr(I) 1 − I   (Wensing, Kim & Slotine 2018)

J is linear in the ten standard parameters. Its rows are scaled by the body's length so that all of
it is in kg: D J D with D = diag(1/ℓ, 1/ℓ, 1/ℓ, 1), a congruence, keeps the sign of eigenvalues.
"""

import numpy as np

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
