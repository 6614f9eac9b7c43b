"""Random states within the limits: where torques are to be predicted well.

Columns that are combined by T, with T⁻ᵀ T⁻¹ = W = mean of yᵀ y over the regressor's rows y at these
states, give every base parameter the same torque there. Then tr((CᵀC)⁻¹ W) is the mean variance of
a predicted torque for noise of one, Σ 1/σ_k² of the singular values of C T, which do not depend on
which columns are called base parameters.
"""

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from excite_cli.constraints.base import Array
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import Regressor
from excite_cli.robot.model import Robot

_STATES = 500


def state_bounds(robot: Robot, accelerations: Array) -> tuple[Array, Array]:
    """Lower and upper bounds (3 n,) of q, v, a; those that random states have where there are none.

    accelerations: (n,), infinite where nothing bounds them.
    """
    q, v, a = robot.draw_states(2000, 0)
    limits = robot.limits
    lower = np.where(np.isfinite(limits.lower), limits.lower, q.min(axis=0))
    upper = np.where(np.isfinite(limits.upper), limits.upper, q.max(axis=0))
    speed = np.minimum(limits.velocity, np.abs(v).max(axis=0))
    rate = np.where(np.isfinite(accelerations), accelerations, np.abs(a).max(axis=0))
    return np.concatenate([lower, -speed, -rate]), np.concatenate([upper, speed, rate])


def reference_rows(
    robot: Robot, base: BaseParameters, accelerations: Array, weights: Array
) -> Array:
    """Rows (N, r) of the regressor, weighted by `weights` (R,), at 500 states within the limits."""
    lower, upper = state_bounds(robot, accelerations)
    states = np.random.default_rng(0).uniform(lower, upper, (_STATES, len(lower)))
    y = Regressor(robot).evaluate(*np.split(states, 3, axis=1))[:, :, base.selection]
    return np.asarray((y * weights[:, None]).reshape(-1, base.rank))


def torque_metric(rows: Array, scales: Array) -> Array:
    """T (r + k, r + k) for columns scaled by `scales` (r + k,); those of k effects stay.

    rows: those of `reference_rows`, unscaled.
    """
    rank = rows.shape[1]
    scaled = rows * scales[:rank] / np.sqrt(len(rows))
    triangle = np.linalg.qr(scaled, mode="r")
    own = solve_triangular(triangle, np.eye(rank))
    return np.asarray(block_diag(own, np.eye(len(scales) - rank)))
