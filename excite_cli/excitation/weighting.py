"""Row weights and column scaling of the regressor, C = diag(w) Y_B diag(s); reference states.

The paper's raw form has neither. Row weights 1/noise make rows of different joints comparable;
column scaling removes the mix of kg, kg·m and kg·m² from the condition number.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from excite_cli.config.spec import CriterionSpec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import Regressor, standard_parameters
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class Weighting:
    """Weight per measured row (R,), scale per base parameter (r,), and their names."""

    rows: Array
    columns: Array
    row_name: str
    column_name: str

    @property
    def plain(self) -> bool:
        """Whether nothing is weighted or scaled."""
        return self.row_name == "none" and self.column_name == "none"


def build_weighting(spec: CriterionSpec, robot: Robot, base: BaseParameters) -> Weighting:
    """Weights and scales that `spec` asks for.

    Raises
    ------
    ConfigError
        A weight names an unknown joint, or effort weights are asked of joints without effort.
    """
    name = spec.row_weights if isinstance(spec.row_weights, str) else "per joint"
    return Weighting(
        _row_weights(spec, robot), _column_scales(spec, robot, base), name, spec.column_scaling
    )


def _row_weights(spec: CriterionSpec, robot: Robot) -> Array:
    weights = np.ones(len(robot.rows))
    if spec.row_weights == "none":
        return weights
    names = robot.row_names
    if spec.row_weights == "effort":
        limits = dict(zip(robot.joint_names, robot.limits.effort, strict=True))
        bad = [joint for joint, effort in limits.items() if not np.isfinite(effort)]
        if bad:
            raise ConfigError(
                f"criterion.row_weights: 'effort' needs effort limits; {', '.join(bad)} have none. "
                "Give robot.limits.<joint>.effort or weights per joint."
            )
        strongest = max(limits.values())
        return np.array([1.0 / limits.get(row, strongest) for row in names])
    for row, weight in spec.row_weights.items():
        if row not in names:
            raise ConfigError(
                f"criterion.row_weights: no measured row '{row}'.{nearest(row, names)} "
                f"Rows: {', '.join(names)}."
            )
        weights[names.index(row)] = weight
    return weights


def _column_scales(spec: CriterionSpec, robot: Robot, base: BaseParameters) -> Array:
    if spec.column_scaling == "none":
        return np.ones(base.rank)
    if spec.column_scaling == "a_priori":
        expected = np.abs(base.mapping @ standard_parameters(robot))
        return np.maximum(expected, 1e-3 * expected.max())
    y = Regressor(robot).evaluate(*robot.draw_states(200, 0))[:, :, base.selection]
    return 1.0 / np.sqrt(np.mean(np.sum(y**2, axis=1), axis=0))


# Random states within the limits: where torques are to be predicted well.
#
# Columns that are combined by T, with T⁻ᵀ T⁻¹ = W = mean of yᵀ y over the regressor's rows y at
# these states, give every base parameter the same torque there. Then tr((CᵀC)⁻¹ W) is the mean
# variance of a predicted torque for noise of one, Σ 1/σ_k² of the singular values of C T, which
# do not depend on which columns are called base parameters.

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
