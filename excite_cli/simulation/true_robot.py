"""Inertias that differ from the URDF, as those of a real robot do, and stay those of some body.

Of a body with pseudo-inertia P = [[Σ, h], [hᵀ, m]] (second moments about the joint, first moment,
mass) the true one is L P Lᵀ with L near 1. That is what moving, stretching and re-weighing the
mass gives: if P ⪰ 0, so is L P Lᵀ.
"""

import numpy as np

from excite_cli.dynamics.pseudo_inertia import pseudo_inertias, ten_parameters
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.robot.model import Array, Robot

_LEAST_MASS = 1e-9
_SHAPE_SHARE, _LEVER_SHARE = 0.5, 0.5


def true_inertias(robot: Robot, error: float, seed: int) -> Array:
    """φ (10·n_bodies,): mass off by 0.5–1.5 times `error`, shape and centre of mass likewise.

    `error` 0.2 changes the parameters by 10–30 %; 0 returns those of the URDF.
    """
    nominal = standard_parameters(robot)
    if error == 0.0:
        return nominal
    rng = np.random.default_rng([seed, 0])
    bodies = nominal.reshape(-1, PARAMETERS_PER_BODY)
    changed = [_changed(ten, error, rng) for ten in bodies]
    return np.concatenate(changed)


def _changed(ten: Array, error: float, rng: np.random.Generator) -> Array:
    """One body's parameters, perturbed; draws as many numbers for every body."""
    scale = 1.0 + rng.choice([-1.0, 1.0]) * error * rng.uniform(0.5, 1.5)
    stretch = _SHAPE_SHARE * error * rng.normal(size=(3, 3)) / np.sqrt(3)
    direction = rng.normal(size=3)
    mass = float(ten[0])
    if mass <= _LEAST_MASS:
        return np.array(ten)
    pseudo = pseudo_inertias(ten)[0]
    lever = ten[1:4] / mass
    spread = np.sqrt(max(np.trace(pseudo[:3, :3]) / mass - lever @ lever, 0.0))
    change = np.eye(4)
    change[:3, :3] += stretch
    change[:3, 3] = _LEVER_SHARE * error * spread * direction / np.linalg.norm(direction)
    return max(scale, 0.05) * ten_parameters(change @ pseudo @ change.T)
