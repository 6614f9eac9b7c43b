"""Row weights and column scaling of the regressor: C = diag(w) Y_B diag(s).

The paper's raw form has neither. Row weights 1/noise make rows of different joints comparable;
column scaling removes the mix of kg, kg·m and kg·m² from the condition number.
"""

from dataclasses import dataclass

import numpy as np

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
