"""The gradient of a problem in three ways: `excite verify-gradient`."""

from excite_cli.api.arguments import checked
from excite_cli.excitation.gradient_check import GradientCheck, check_gradient
from excite_cli.excitation.problem import Problem
from excite_cli.summary.gradient import gradient_answer as gradient_answer


@checked()
def verify_gradient(problem: Problem) -> GradientCheck:
    """Adjoint, the paper's block form and differences at a random motion of the config's seed.

    Returns
    -------
    GradientCheck
        `relative_error` of each pair, `seconds` of each way, and whether all `passed`.
    """
    return check_gradient(problem, problem.spec.seed)
