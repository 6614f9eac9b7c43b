"""Condition numbers between the samples of the cost."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.excitation.dense_grid import dense_condition_number, flattered
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _motion(problem: Problem, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    shape = (problem.trajectory.n_coefficients, problem.robot.n)
    return np.asarray(0.2 * rng.normal(size=shape))


def test_it_is_the_condition_number_of_eight_times_as_many_rows() -> None:
    problem = load_problem(SMOKE, ["sampling.cost={samples: 20, step: 0.3}"])
    alpha = _motion(problem, 1)
    times = np.arange(160) * 0.3 / 8
    basis = problem.trajectory.basis(times)
    rows = replace(problem, cost_basis=basis).objective().block(alpha)
    dense = dense_condition_number(problem, Stack.empty(problem.columns), alpha)
    assert dense == pytest.approx(condition_number(singular_values(rows)), rel=1e-9)


def test_earlier_motions_count_as_much_as_on_the_samples() -> None:
    problem = load_problem(SMOKE, ["sampling.cost={samples: 120, step: 0.05}"])
    first, second = _motion(problem, 1), _motion(problem, 2)
    stack = Stack.empty(problem.columns).with_rows(problem.objective().block(first))
    coarse = problem.objective(stack).stacked_condition_number(second)
    assert dense_condition_number(problem, stack, second) == pytest.approx(coarse, rel=0.01)


def test_a_motion_that_is_shaped_to_few_samples_is_told() -> None:
    assert flattered(5.0, 5.2)
    assert not flattered(5.0, 5.05)
    assert not flattered(5.0, None)
