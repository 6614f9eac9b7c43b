"""Figures and criteria that do not depend on which columns are called base parameters."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import qr

from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.dynamics.base_parameters import base_parameters_as_given
from excite_cli.dynamics.regressor import Regressor
from excite_cli.excitation.gradient_check import check_gradient
from excite_cli.excitation.invariant import FreeDesign, design_for, invariants
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.sequence import dense_condition_number, flattered
from excite_cli.excitation.weighting import reference_rows, torque_metric
from tests.excitation.smoke import drawn, smoke

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
    problem = smoke("criterion.kind=torque_deviation")
    return [_with(problem, name) for name in CHOICES]


def test_the_choices_are_different_and_so_are_condition_numbers(problems: list[Problem]) -> None:
    chosen = {tuple(problem.base.selection) for problem in problems}
    assert len(chosen) == len(CHOICES)
    numbers = [p.objective().own_condition_number(drawn(p, 0.3, 1)) for p in problems]
    assert max(numbers) > 1.5 * min(numbers)


def test_deviation_and_efficiency_are_the_same_for_all(problems: list[Problem]) -> None:
    values, gradients, data = [], [], []
    for problem in problems:
        stack = Stack.empty(problem.columns).with_rows(
            problem.objective().block(drawn(problem, 0.3, 1))
        )
        value, gradient, _ = problem.objective(stack).value_and_gradient(
            drawn(problem, 0.3, 2), problem.criterion
        )
        values.append(value)
        gradients.append(gradient)
        assert problem.base.mapping.shape[0] == problem.base.rank
        y = Regressor(problem.robot).evaluate(*problem.robot.draw_states(60, 5))
        y = y[:, :, problem.base.selection].reshape(-1, problem.base.rank)
        data.append(invariants(problem, stack, FreeDesign(y.T @ y / 60, 0.0)))
    assert values[1:] == pytest.approx(values[:1] * 2, rel=1e-9)
    for gradient, found in zip(gradients[1:], data[1:], strict=True):
        assert np.allclose(gradient, gradients[0], atol=1e-8 * np.abs(gradients[0]).max())
        assert found.torque_deviation == pytest.approx(data[0].torque_deviation, rel=1e-9)
        assert found.efficiency == pytest.approx(data[0].efficiency, rel=1e-8)


def test_an_effect_that_no_motion_shows_takes_nothing_away() -> None:
    """A torque that saturates has no column in motions that stay below it."""
    problem = smoke("effects=[{kind: viscous_friction}]")
    bare = smoke("effects=null")
    block = problem.objective().block(drawn(problem, 0.3, 1))
    block[:, problem.base.rank :] = 0.0
    shown = bare.objective().block(drawn(bare, 0.3, 1))
    found, same = (
        invariants(each, Stack.empty(each.columns).with_rows(rows)).torque_deviation
        for each, rows in ((problem, block), (bare, shown))
    )
    assert found == pytest.approx(same, rel=1e-9)


def test_the_value_is_the_deviation_of_predicted_torques(problems: list[Problem]) -> None:
    problem = problems[0]
    block = problem.objective().block(drawn(problem, 0.3, 1))
    rows = reference_rows(
        problem.robot, problem.base, np.full(problem.robot.n, 10.0), problem.weighting.rows
    )
    variance = np.einsum("ik,kl,il->i", rows, np.linalg.inv(block.T @ block), rows).mean()
    value = problem.objective().value(drawn(problem, 0.3, 1), problem.criterion)
    assert value == pytest.approx(0.5 * np.log(variance), rel=1e-7)


@pytest.mark.parametrize("effects", ["null", "[{kind: viscous_friction}]"])
def test_its_gradient_is_exact(effects: str) -> None:
    problem = smoke("criterion.kind=torque_deviation", f"effects={effects}")
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


def test_it_is_the_condition_number_of_eight_times_as_many_rows() -> None:
    problem = smoke("sampling.cost={samples: 20, step: 0.3}")
    alpha = drawn(problem, 0.2, 1)
    times = np.arange(160) * 0.3 / 8
    basis = problem.trajectory.basis(times)
    rows = replace(problem, cost_basis=basis).objective().block(alpha)
    dense = dense_condition_number(problem, Stack.empty(problem.columns), alpha)
    assert flattered(5.0, 5.2)
    assert not flattered(5.0, 5.05)
    assert not flattered(5.0, None)
    assert dense == pytest.approx(condition_number(singular_values(rows)), rel=1e-9)


def test_earlier_motions_count_as_much_as_on_the_samples() -> None:
    problem = smoke("sampling.cost={samples: 120, step: 0.05}")
    first, second = drawn(problem, 0.2, 1), drawn(problem, 0.2, 2)
    stack = Stack.empty(problem.columns).with_rows(problem.objective().block(first))
    coarse = problem.objective(stack).stacked_condition_number(second)
    assert dense_condition_number(problem, stack, second) == pytest.approx(coarse, rel=0.01)


def test_the_deviation_does_not_depend_on_how_columns_are_scaled() -> None:
    plain, scaled = (
        smoke(f"criterion.column_scaling={each}", "effects=null") for each in ("none", "unit_norm")
    )
    one, other = (
        invariants(
            each, Stack.empty(each.columns).with_rows(each.objective().block(drawn(each, 0.3, 1)))
        )
        for each in (plain, scaled)
    )
    assert one.torque_deviation == pytest.approx(other.torque_deviation, rel=1e-9)
