"""Figures and criteria that do not depend on which columns are called base parameters."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import qr

from excite_cli.api.loading import load_problem
from excite_cli.dynamics.base_parameters import base_parameters_as_given
from excite_cli.dynamics.regressor import Regressor
from excite_cli.excitation.free_design import FreeDesign
from excite_cli.excitation.gradient_check import check_gradient
from excite_cli.excitation.invariant import design_for, invariants
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.reference_states import reference_rows, torque_metric
from excite_cli.excitation.stack import Stack

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"
CHOICES = ("own", "first", "last")


def _choice(problem: Problem, name: str) -> np.ndarray:
    """Columns that can stand for the base parameters: ours, the first or last independent ones."""
    if name == "own":
        return problem.base.selection
    robot = problem.robot
    y = Regressor(robot).evaluate(*robot.draw_states(80, 3)).reshape(-1, 10 * robot.n_bodies)
    order = np.arange(y.shape[1]) if name == "first" else np.arange(y.shape[1])[::-1]
    triangle = qr(y[:, order], mode="r")[0]
    taken: list[int] = []
    for column in range(len(order)):
        rank = np.linalg.matrix_rank(triangle[:, [*taken, column]], tol=1e-8 * y.max())
        if rank > len(taken):
            taken.append(column)
    return np.sort(order[taken])


def _with(problem: Problem, name: str) -> Problem:
    chosen = _choice(problem, name)
    base = base_parameters_as_given(problem.robot, chosen=chosen)
    rows = reference_rows(
        problem.robot, base, np.full(problem.robot.n, 10.0), problem.weighting.rows
    )
    metric = torque_metric(rows, problem.column_scales)
    return replace(problem, base=base, metric=metric)


@pytest.fixture(scope="module")
def problems() -> list[Problem]:
    problem = load_problem(SMOKE, ["criterion.kind=torque_deviation"])
    return [_with(problem, name) for name in CHOICES]


def _motion(problem: Problem, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    shape = (problem.trajectory.n_coefficients, problem.robot.n)
    return np.asarray(0.3 * rng.normal(size=shape))


def test_the_choices_are_different_and_so_are_condition_numbers(problems: list[Problem]) -> None:
    chosen = {tuple(problem.base.selection) for problem in problems}
    assert len(chosen) == len(CHOICES)
    numbers = [p.objective().own_condition_number(_motion(p)) for p in problems]
    assert max(numbers) > 1.5 * min(numbers)


def test_torque_deviation_is_the_same_for_all(problems: list[Problem]) -> None:
    values, gradients = [], []
    for problem in problems:
        stack = Stack.empty(problem.columns).with_rows(problem.objective().block(_motion(problem)))
        value, gradient, _ = problem.objective(stack).value_and_gradient(
            _motion(problem, 2), problem.criterion
        )
        values.append(value)
        gradients.append(gradient)
    assert values[1:] == pytest.approx(values[:1] * 2, rel=1e-9)
    for gradient in gradients[1:]:
        assert np.allclose(gradient, gradients[0], atol=1e-8 * np.abs(gradients[0]).max())


def test_efficiency_and_deviation_of_data_are_the_same_for_all(problems: list[Problem]) -> None:
    found = []
    for problem in problems:
        base = problem.base.mapping
        assert base.shape[0] == problem.base.rank
        stack = Stack.empty(problem.columns).with_rows(problem.objective().block(_motion(problem)))
        found.append(invariants(problem, stack, _same_design(problems[0], problem)))
    for other in found[1:]:
        assert other.torque_deviation == pytest.approx(found[0].torque_deviation, rel=1e-9)
        assert other.efficiency == pytest.approx(found[0].efficiency, rel=1e-8)


def _same_design(first: Problem, problem: Problem) -> FreeDesign:
    """A design over fixed states, on the columns of `problem`."""
    robot = problem.robot
    y = Regressor(robot).evaluate(*robot.draw_states(60, 5))[:, :, problem.base.selection]
    y = y.reshape(-1, problem.base.rank)
    return FreeDesign(y.T @ y / 60, 0.0)


def test_an_effect_that_no_motion_shows_takes_nothing_away() -> None:
    """A torque that saturates has no column in motions that stay below it."""
    problem = load_problem(SMOKE, ["effects=[{kind: viscous_friction}]"])
    bare = load_problem(SMOKE, ["effects=null"])
    block = problem.objective().block(_motion(problem))
    block[:, problem.base.rank :] = 0.0
    shown = bare.objective().block(_motion(bare))
    found, same = (
        invariants(each, Stack.empty(each.columns).with_rows(rows)).torque_deviation
        for each, rows in ((problem, block), (bare, shown))
    )
    assert found == pytest.approx(same, rel=1e-9)


def test_the_value_is_the_deviation_of_predicted_torques(problems: list[Problem]) -> None:
    problem = problems[0]
    block = problem.objective().block(_motion(problem))
    rows = reference_rows(
        problem.robot, problem.base, np.full(problem.robot.n, 10.0), problem.weighting.rows
    )
    variance = np.einsum("ik,kl,il->i", rows, np.linalg.inv(block.T @ block), rows).mean()
    value = problem.objective().value(_motion(problem), problem.criterion)
    assert value == pytest.approx(0.5 * np.log(variance), rel=1e-7)


@pytest.mark.parametrize("effects", ["null", "[{kind: viscous_friction}]"])
def test_its_gradient_is_exact(effects: str) -> None:
    problem = load_problem(SMOKE, ["criterion.kind=torque_deviation", f"effects={effects}"])
    errors = check_gradient(problem)
    assert errors.relative_error["adjoint_vs_central"] < 1e-7
    assert errors.relative_error["adjoint_vs_block"] < 1e-10
    assert errors.passed


def test_no_design_over_states_is_better_than_the_free_one(problems: list[Problem]) -> None:
    problem = problems[0]
    design = design_for(problem)
    assert 0.0 <= design.slack < 0.5
    robot = problem.robot
    bound = np.exp(design.slack)
    rng = np.random.default_rng(8)
    for seed in range(20):  # states anywhere within the limits, as motions have them
        q, v, _ = robot.draw_states(40, seed)
        a = rng.uniform(-5.0, 5.0, q.shape)
        y = Regressor(robot).evaluate(q, v, a)[:, :, problem.base.selection]
        y = y.reshape(-1, problem.base.rank)
        assert design.efficiency(y.T @ y, len(q)) < bound
    same = design.efficiency(7.0 * design.information, 7.0)
    assert same == pytest.approx(1.0)
