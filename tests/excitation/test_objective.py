"""The cost's gradient: every criterion, weighting, robot and prior, three ways."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.catalogue import CRITERIA, build_criterion
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.block_form import block_pull_back
from excite_cli.excitation.gradient_check import fourth_order_differences, relative_error
from excite_cli.excitation.objective import Objective
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.weighting import build_weighting
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.robot.random_robots import random_robot

TRAJECTORY = FourierTrajectory(harmonics=3, base_frequency=1.0)


def _objective(robot: Robot, spec: CriterionSpec, prior: bool, samples: int = 0) -> Objective:
    base = find_base_parameters(robot)
    enough = samples or -(-3 * base.rank // len(robot.rows))
    basis = TRAJECTORY.basis(np.linspace(0, TRAJECTORY.duration, enough, endpoint=False))
    weighting = build_weighting(spec, robot, base)
    stack = Stack.empty(base.rank)
    if prior:
        earlier = Objective(robot, base, weighting, basis)
        stack = stack.with_rows(earlier.block(_motion(robot, 99)))
    return Objective(robot, base, weighting, basis, stack)


def _motion(robot: Robot, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(TRAJECTORY.n_coefficients, robot.n))


@settings(max_examples=12, derandomize=True, deadline=None)
@given(
    seed=st.integers(0, 9999),
    joints=st.integers(2, 5),
    floating=st.booleans(),
    prior=st.booleans(),
)
def test_adjoint_block_form_and_differences_agree(
    seed: int, joints: int, floating: bool, prior: bool
) -> None:
    robot = random_robot(seed, joints=joints, floating=floating)
    spec = CriterionSpec()
    objective, criterion = _objective(robot, spec, prior), build_criterion(spec)
    alpha = _motion(robot, seed)
    _, adjoint, spectrum = objective.value_and_gradient(alpha, criterion)
    block = objective.block(alpha)
    left, right = objective.pairs(block, objective.spectrum(block), criterion)
    states = objective.basis.states(alpha)
    by_block = objective.basis.pull_back(
        *block_pull_back(robot, *states, left.transpose(1, 2, 0) @ right)
    )
    assert relative_error(adjoint, by_block) < 1e-9
    if spectrum.condition_number < 1e4:
        central = fourth_order_differences(lambda x: objective.value(x, criterion), alpha)
        assert relative_error(adjoint, central) < 1e-7


@pytest.mark.parametrize("kind", sorted(CRITERIA))
@pytest.mark.parametrize("prior", [False, True])
def test_every_criterion_with_every_continuation(kind: str, prior: bool) -> None:
    robot = random_robot(21, joints=4)
    spec = CriterionSpec(kind=kind, smoothing=12.0)
    objective, alpha = _objective(robot, spec, prior), _motion(robot, 4)
    criterion = build_criterion(spec)
    for member in (criterion, *criterion.continuation()):
        _, gradient, _ = objective.value_and_gradient(alpha, member)
        central = fourth_order_differences(lambda x, m=member: objective.value(x, m), alpha)
        assert relative_error(gradient, central) < 1e-7, member


@pytest.mark.parametrize("rows", ["none", "effort", {"joint_2": 3.0}])
@pytest.mark.parametrize("columns", ["none", "unit_norm", "a_priori"])
def test_weights_enter_value_and_gradient(rows: str | dict, columns: str) -> None:
    robot = random_robot(8, joints=4)
    spec = CriterionSpec(row_weights=rows, column_scaling=columns)
    objective, criterion = _objective(robot, spec, prior=False), build_criterion(spec)
    alpha = _motion(robot, 1)
    plain = _objective(robot, CriterionSpec(), prior=False).block(alpha)
    weighting = objective.weighting
    expected = plain * np.tile(weighting.rows, len(plain) // robot.n)[:, None] * weighting.columns
    assert np.allclose(objective.block(alpha), expected)
    assert objective.own_condition_number(alpha) == pytest.approx(np.linalg.cond(expected))
    _, gradient, _ = objective.value_and_gradient(alpha, criterion)
    central = fourth_order_differences(lambda x: objective.value(x, criterion), alpha)
    assert relative_error(gradient, central) < 1e-7


def test_stack_of_many_motions_is_that_of_all_rows_at_once() -> None:
    robot = random_robot(6, joints=3)
    objective = _objective(robot, CriterionSpec(), prior=False)
    blocks = [objective.block(_motion(robot, seed)) for seed in range(5)]
    stack = Stack.empty(objective.base.rank)
    for block in blocks:
        stack = stack.with_rows(block)
    whole = np.vstack(blocks)
    assert stack.rows == len(whole)
    assert np.allclose(stack.factor.T @ stack.factor, whole.T @ whole)
    assert np.allclose(np.tril(stack.factor, -1), 0)


def test_badly_conditioned_stack_keeps_its_small_singular_values() -> None:
    robot = random_robot(6, joints=3)
    objective = _objective(robot, CriterionSpec(), prior=False)
    rank = objective.base.rank
    rng = np.random.default_rng(0)
    sigma = np.geomspace(1.0, 1e-9, rank)
    left = np.linalg.qr(rng.normal(size=(4 * rank, rank)))[0]
    right = np.linalg.qr(rng.normal(size=(rank, rank)))[0]
    found = objective.spectrum((left * sigma) @ right.T).sigma
    assert np.allclose(found, sigma, rtol=1e-5)
