"""All solvers by their name in the YAML file."""

from excite_cli.config.spec import OptimizerSpec
from excite_cli.excitation.solvers.base import Solver
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.solvers.slsqp import ScipySlsqp
from excite_cli.excitation.solvers.sqp import SequentialQuadratic


def build_solver(spec: OptimizerSpec) -> Solver:
    """The solver that `spec` asks for.

    Raises
    ------
    MissingExtraError
        `method: sqp` without the library of `qp_solver`.
    """
    if spec.method == "sqp":
        return SequentialQuadratic(spec.qp_solver)
    if spec.method == "slsqp":
        return ScipySlsqp()
    return InteriorPoint()
