"""Columns of effects beside the base regressor: exact gradients, scales, what is left out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.load import load_spec
from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.catalogue import build_criterion
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.effect_columns import EffectColumns
from excite_cli.excitation.extension import extend
from excite_cli.excitation.gradient_check import (
    check_gradient,
    fourth_order_differences,
    relative_error,
)
from excite_cli.excitation.objective import Objective
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.weighting import build_weighting
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.robot.random_robots import random_robot

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
TRAJECTORY = FourierTrajectory(harmonics=3, base_frequency=1.0)
EXCITABLE = sorted(name for name, kind in catalogue().items() if kind.excitable)


def _problem(effects: str, *changes: str) -> Problem:
    common = ("constraints.self_collision=null", "constraints.torque=null", "sequence.motions=1")
    return build_problem(
        load_spec(CONFIG, [*common, f"effects={effects}", *changes]), CONFIG.parent
    )


def _effects(robot: Robot, kinds: list[str], rng: np.random.Generator) -> list[Effect]:
    found = []
    for name in kinds:
        kind = catalogue()[name]
        places = kind.places(robot)
        if places:
            shape, _ = kind.planted(1.0, {})
            found.append(kind(places[rng.integers(len(places))], shape))
    return found


def _objective(robot: Robot, effects: list[Effect], spec: CriterionSpec, prior: bool) -> Objective:
    base = find_base_parameters(robot)
    weighting = build_weighting(spec, robot, base)
    extension = extend(robot, base, weighting, effects, TRAJECTORY.duration)
    samples = -(-3 * (base.rank + len(extension.names)) // len(robot.rows))
    basis = TRAJECTORY.basis(np.linspace(0, TRAJECTORY.duration, samples, endpoint=False))
    plain = Objective(robot, base, weighting, basis, None, extension)
    stack = Stack.empty(plain.size)
    if prior:
        stack = stack.with_rows(plain.block(_motion(robot, 99)))
    return Objective(robot, base, weighting, basis, stack, extension)


def _motion(robot: Robot, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 0.7 * rng.normal(size=(TRAJECTORY.n_coefficients, robot.n))


def _error(objective: Objective, criterion: object, alpha: np.ndarray) -> float:
    """Smallest disagreement over several steps: a wrong gradient disagrees with all."""
    _, gradient, _ = objective.value_and_gradient(alpha, criterion)
    return min(
        relative_error(
            gradient, fourth_order_differences(lambda x: objective.value(x, criterion), alpha, h)
        )
        for h in (1e-4, 3e-5, 1e-5, 3e-6)
    )


def test_effects_count_time_from_the_begin_of_the_motion() -> None:
    """As recordings of it do, whatever instants the cost looks at."""
    robot = random_robot(31, joints=3)
    columns = EffectColumns(robot, _effects(robot, ["spring"], np.random.default_rng(2)))
    state = np.zeros((5, robot.n))
    signals = columns.signals(3.0 + np.arange(5.0), state, state, state)
    assert signals.t.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize("kind", EXCITABLE)
def test_every_kind_is_pulled_back_to_the_coefficients(kind: str) -> None:
    """Σ W ∘ columns for a random W: no criterion, no singular value, nothing that could hide."""
    robot = random_robot(31, joints=3)
    columns = EffectColumns(robot, _effects(robot, [kind], np.random.default_rng(2)))
    basis = TRAJECTORY.basis(np.linspace(0, TRAJECTORY.duration, 30, endpoint=False))
    rng = np.random.default_rng(7)
    weights = rng.normal(size=(30, 3, columns.count))

    def value(alpha: np.ndarray) -> float:
        seen = columns.evaluate(basis.times, *basis.states(alpha))
        return float(np.sum(weights * seen.columns))

    largest = 0.0
    for size in (1.0, 0.05):  # the small motion stays where signs are not flat
        alpha = size * _motion(robot, 3)
        seen = columns.evaluate(basis.times, *basis.states(alpha))
        found = basis.pull_back(*columns.pull_back(seen, weights))
        errors = [
            relative_error(found, fourth_order_differences(value, alpha, h))
            for h in (3e-5, 1e-5, 3e-6)
        ]
        assert min(errors) < 1e-7
        largest = max(largest, float(np.abs(found).max()))
    assert (largest > 0) == (kind != "torque_offset")  # a constant has no derivative


@settings(max_examples=12, derandomize=True, deadline=None)
@given(
    seed=st.integers(0, 9999),
    floating=st.booleans(),
    prior=st.booleans(),
    kinds=st.lists(st.sampled_from(EXCITABLE), min_size=1, max_size=3, unique=True),
)
def test_random_effects_on_random_robots(
    seed: int, floating: bool, prior: bool, kinds: list[str]
) -> None:
    robot = random_robot(seed, joints=3, floating=floating)
    effects = _effects(robot, kinds, np.random.default_rng(seed))
    weights = CriterionSpec(row_weights={robot.row_names[-1]: 2.0}, column_scaling="unit_norm")
    objective = _objective(robot, effects, weights, prior)
    alpha = _motion(robot, seed)
    if np.linalg.cond(objective.block(alpha)) < 3e3:
        assert _error(objective, SmoothConditionNumber(6.0), alpha) < 1e-6


def test_columns_are_torque_per_unit_in_the_rows_of_the_joint() -> None:
    robot = random_robot(5, joints=4)
    effects = [ViscousFriction((2,)), CoulombFriction((1,))]
    objective = _objective(robot, effects, CriterionSpec(row_weights={"joint_3": 3.0}), prior=False)
    _, v, _ = objective.basis.states(_motion(robot, 1))
    assert objective.extension is not None
    block = objective.block(_motion(robot, 1)).reshape(len(v), 4, -1)[:, :, -2:]
    expected = np.zeros_like(block)
    expected[:, 2, 0] = 3.0 * v[:, 2] * objective.extension.scales[0]
    expected[:, 1, 1] = np.tanh(v[:, 1] / 0.02) * objective.extension.scales[1]
    assert np.allclose(block, expected)


def test_effects_get_the_size_of_the_median_inertial_column() -> None:
    problem = _problem("[{kind: viscous_friction}, {kind: spring, joints: [elbow]}]")
    robot = problem.robot
    block = problem.objective().block_of(np.linspace(0, 6, 4000), *robot.draw_states(4000, 1))
    sizes = np.linalg.norm(block, axis=0)
    typical = np.median(sizes[: problem.base.rank])
    assert np.allclose(sizes[problem.base.rank :], typical, rtol=0.15)


def test_without_effects_in_the_yaml_the_raw_form_is_untouched() -> None:
    plain, none = _problem("null"), _problem("[]")
    assert plain.columns == none.columns == plain.base.rank
    alpha = plain.still(plain.robot.posture) + 0.1
    q, v, a = plain.cost_basis.states(alpha)
    from excite_cli.dynamics.regressor import Regressor

    y = Regressor(plain.robot).evaluate(q, v, a)[:, :, plain.base.selection]
    block = plain.objective().block(alpha)
    np.testing.assert_allclose(block, y.reshape(-1, plain.base.rank), atol=1e-12)
    np.testing.assert_array_equal(block, none.objective().block(alpha))


def test_what_the_regressor_has_already_is_left_out_with_the_parameters_named() -> None:
    problem = _problem("[{kind: armature, joints: [shoulder_yaw]}, {kind: viscous_friction}]")
    (reason,) = problem.extension.left_out
    assert reason.startswith("armature on shoulder_yaw: the regressor shows it already in")
    assert "Izz[shoulder_pitch]" in reason or "Izz[shoulder_yaw]" in reason
    assert len(problem.extension.effects) == problem.robot.n
    twice = _problem("[{kind: coulomb_friction, joints: [elbow]}, "
                     "{kind: asymmetric_friction, joints: [elbow]}, "
                     "{kind: torque_offset, joints: [elbow]}]")  # fmt: skip
    assert any("asymmetric_friction on elbow" in r or "torque_offset on elbow" in r
               for r in twice.extension.left_out)  # fmt: skip


def test_effects_of_single_runs_and_without_columns_are_left_out() -> None:
    problem = _problem("[{kind: viscous_friction, joints: [elbow], runs: [a, b]}]")
    assert problem.extension.left_out == (
        "viscous_friction on elbow: it is present in recorded runs only (a, b)",
    )
    for name, kind in catalogue().items():
        if not kind.excitable and kind.scope != "base":
            column = ", covariate: temp" if kind.follows_covariate else ""
            (reason, *_) = _problem(f"[{{kind: {name}{column}}}]").extension.left_out
            assert kind.why_not_excitable in reason


def test_a_base_wrench_does_not_show_friction() -> None:
    robot = random_robot(12, joints=3, floating=True, rows=("base",))
    base = find_base_parameters(robot)
    weighting = build_weighting(CriterionSpec(), robot, base)
    extension = extend(robot, base, weighting, [ViscousFriction((0,))], 6.0)
    assert extension.names == ()
    assert "none of its joints is a measured row" in extension.left_out[0]


def test_time_derivatives_are_taken_on_the_fine_grid_with_the_same_weight() -> None:
    plain, late = _problem("[]"), _problem("[{kind: torque_delay}]")
    assert late.extension.fine
    assert len(late.cost_basis.times) == len(late.constraint_basis.times) == 120
    rng = np.random.default_rng(0)
    alpha = 0.3 * rng.normal(size=(plain.trajectory.n_coefficients, plain.robot.n))
    rank = plain.base.rank
    coarse, fine = plain.objective().block(alpha), late.objective().block(alpha)[:, :rank]
    assert np.trace(fine.T @ fine) == pytest.approx(np.trace(coarse.T @ coarse), rel=0.02)
    assert check_gradient(late, repeats=2).passed


def test_too_few_samples_for_the_effects_too() -> None:
    with pytest.raises(ConfigError, match="26 base parameters and 10 of effects"):
        _problem("[{kind: viscous_friction},{kind: coulomb_friction}]",
                 "sampling.cost={samples: 7, step: 0.5}")  # fmt: skip


def test_gradient_check_covers_the_effects_and_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = _problem("[{kind: coulomb_friction}, {kind: load_dependent_friction}]")
    found = check_gradient(problem, repeats=2)
    assert found.passed
    exact = CoulombFriction.pull_back

    def wrong(self: CoulombFriction, *arguments: object) -> object:
        cotangents = exact(self, *arguments)
        assert cotangents.v is not None
        return replace(cotangents, v=1.5 * cotangents.v)

    monkeypatch.setattr(CoulombFriction, "pull_back", wrong)
    spoiled = check_gradient(problem, repeats=2)
    assert not spoiled.passed
    assert spoiled.relative_error["adjoint_vs_block"] < 1e-9  # the inertial part is still right


def test_a_motion_for_friction_shows_it_and_its_stack_fits_no_other_model() -> None:
    quick = ("optimizer.max_iterations=25",)
    effects = "[{kind: viscous_friction}, {kind: coulomb_friction}]"
    problem = _problem(effects, *quick)

    def run(of: Problem) -> object:
        return continue_run(of, new_result(of, [], {}), lambda i: lambda p: None, lambda s, c: None)

    result = run(problem)
    (motion,) = result.motions
    block = problem.objective().block(motion.coefficients)
    assert motion.condition_number == pytest.approx(np.linalg.cond(block), rel=1e-6)
    assert motion.condition_number < 60
    assert result.effect_names[0] == "viscous_friction[shoulder_yaw].viscous"
    assert len(result.base_words) == len(result.column_scales) == problem.columns
    new_result(problem, [("a.h5", result)], {})
    with pytest.raises(FileError, match=r"regressor has other effects .*here none"):
        new_result(_problem("[]"), [("a.h5", result)], {})
    other = _problem("[{kind: viscous_friction}]")
    with pytest.raises(FileError, match=r"coulomb_friction\[slide\]"):
        new_result(other, [("a.h5", result)], {})


def test_criteria_are_those_of_the_extended_matrix() -> None:
    problem = _problem("[{kind: spring}]")
    objective, alpha = problem.objective(), problem.still(problem.robot.posture)
    alpha = alpha + 0.2 * np.random.default_rng(4).normal(size=alpha.shape)
    block = objective.block(alpha)
    sigma = np.linalg.svd(block, compute_uv=False)
    assert block.shape[1] == problem.base.rank + 2 * problem.robot.n  # stiffness and preload
    criterion = build_criterion(CriterionSpec(kind="log_det"))
    assert objective.value(alpha, criterion) == pytest.approx(criterion.value(sigma), rel=1e-9)
