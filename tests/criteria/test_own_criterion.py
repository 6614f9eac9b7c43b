"""A criterion that the program has never seen, in one class and a line of the catalogue."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.criteria.base import Array, Criterion
from excite_cli.criteria.catalogue import CRITERIA
from excite_cli.excitation.generate import generate_motion
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.stack import Stack

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


class WorstThree(Criterion):
    """Minus the mean logarithm of the three smallest singular values."""

    name = "worst_three"

    def value(self, sigma: Array) -> float:
        return -float(np.mean(np.log(sigma[-3:])))

    def derivative(self, sigma: Array) -> Array:
        derivative = np.zeros_like(sigma)
        derivative[-3:] = -1.0 / (3.0 * sigma[-3:])
        return derivative


def _planned(kind: str) -> tuple[Problem, float]:
    overrides = [f"criterion.kind={kind}", "optimizer.max_iterations=40"]
    problem = build_problem(load_spec(CONFIG, overrides), CONFIG.parent)
    stack = Stack.empty(problem.columns)
    motion = generate_motion(problem, InteriorPoint(), stack, 1, 1, lambda progress: None)
    objective = problem.objective()
    sigma = objective.spectrum(objective.block(motion.coefficients)).sigma
    return problem, WorstThree().value(sigma)


def test_a_plan_by_it_is_better_by_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CRITERIA, "worst_three", lambda spec: WorstThree())
    problem, reached = _planned("worst_three")
    assert isinstance(problem.criterion, WorstThree)
    _, by_another = _planned("condition_number")
    assert reached < by_another - 0.05
