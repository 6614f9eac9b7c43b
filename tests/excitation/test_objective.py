"""The cost's gradient, three ways: every criterion, weighting, robot, prior and effect.

With it columns of effects beside the base regressor, and divergences between effects.
"""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.catalogue import CRITERIA, build_criterion
from excite_cli.criteria.sigma_min import SigmaMin, SmoothSigmaMin
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.block_form import block_pull_back
from excite_cli.dynamics.regressor import Regressor
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.discrimination import (
    SEPARATED,
    Direction,
    Discrimination,
    Separation,
    divergences,
    motions_needed,
    residual_directions,
)
from excite_cli.excitation.effect_columns import EffectColumns, extend
from excite_cli.excitation.gradient_check import (
    FOURTH_ORDER_STEP,
    check_gradient,
    fourth_order_differences,
    relative_error,
)
from excite_cli.excitation.objective import Objective, Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import ProgressMeasure
from excite_cli.excitation.run import new_result
from excite_cli.excitation.weighting import build_weighting
from excite_cli.robot.model import Robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.excitation.smoke import drawn, planned, smoke
from tests.robot.random_robots import random_robot

TRAJECTORY = FourierTrajectory(harmonics=3, base_frequency=1.0)


def _objective(
    robot: Robot,
    spec: CriterionSpec,
    prior: bool,
    effects: Sequence[Effect] = (),
) -> Objective:
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


def _error(
    objective: Objective, criterion: object, alpha: np.ndarray, steps: tuple = (FOURTH_ORDER_STEP,)
) -> float:
    """Smallest disagreement over several steps: a wrong gradient disagrees with all."""
    _, gradient, _ = objective.value_and_gradient(alpha, criterion)
    return min(
        relative_error(
            gradient, fourth_order_differences(lambda x: objective.value(x, criterion), alpha, h)
        )
        for h in steps
    )


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
        assert _error(objective, criterion, alpha) < 1e-7


@pytest.mark.parametrize("kind", sorted(CRITERIA.members))
@pytest.mark.parametrize("prior", [False, True])
def test_every_criterion_with_every_continuation(kind: str, prior: bool) -> None:
    robot = random_robot(21, joints=4)
    spec = CriterionSpec(kind=kind, smoothing=12.0)
    objective, alpha = _objective(robot, spec, prior), _motion(robot, 4)
    criterion = build_criterion(spec)
    for member in (criterion, *criterion.continuation()):
        assert _error(objective, member, alpha) < 1e-7, member


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
    assert _error(objective, criterion, alpha) < 1e-7


def test_stacks_are_those_of_all_rows_and_keep_small_singular_values() -> None:
    robot = random_robot(6, joints=3)
    objective = _objective(robot, CriterionSpec(), prior=False)
    rank = objective.base.rank
    blocks = [objective.block(_motion(robot, seed)) for seed in range(5)]
    stack = Stack.empty(rank)
    for block in blocks:
        stack = stack.with_rows(block)
    whole = np.vstack(blocks)
    assert stack.rows == len(whole)
    assert np.allclose(stack.factor.T @ stack.factor, whole.T @ whole)
    assert np.allclose(np.tril(stack.factor, -1), 0)
    rng = np.random.default_rng(0)
    sigma = np.geomspace(1.0, 1e-9, rank)
    left = np.linalg.qr(rng.normal(size=(4 * rank, rank)))[0]
    right = np.linalg.qr(rng.normal(size=(rank, rank)))[0]
    found = objective.spectrum((left * sigma) @ right.T).sigma
    assert np.allclose(found, sigma, rtol=1e-5)


EXCITABLE = sorted(name for name, kind in catalogue().items() if kind.excitable)


def _problem(effects: str, *changes: str) -> Problem:
    common = ("constraints.self_collision=null", "constraints.torque=null", "sequence.motions=1")
    return smoke(*common, f"effects={effects}", *changes)


def _effects(robot: Robot, kinds: list[str], rng: np.random.Generator) -> list[Effect]:
    found = []
    for name in kinds:
        kind = catalogue()[name]
        places = kind.places(robot)
        if places:
            shape, _ = kind.planted(1.0, {})
            found.append(kind(places[rng.integers(len(places))], shape))
    return found


@pytest.mark.parametrize("kind", EXCITABLE)
def test_every_kind_is_pulled_back_to_the_coefficients(kind: str) -> None:
    """Σ W ∘ columns for a random W: no criterion, no singular value, nothing that could hide."""
    robot = random_robot(31, joints=3)
    columns = EffectColumns(robot, _effects(robot, [kind], np.random.default_rng(2)))
    basis = TRAJECTORY.basis(np.linspace(0, TRAJECTORY.duration, 30, endpoint=False))
    weights = np.random.default_rng(7).normal(size=(30, 3, columns.count))

    def value(alpha: np.ndarray) -> float:
        seen = columns.evaluate(basis.times, *basis.states(alpha))
        return float(np.sum(weights * seen.columns))

    largest = 0.0
    for size in (0.7, 0.035):  # the small motion stays where signs are not flat
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
    # As recordings do, effects count time from the begin of the motion.
    state = np.zeros((5, robot.n))
    signals = columns.signals(3.0 + np.arange(5.0), state, state, state)
    assert signals.t.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


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
    objective = _objective(robot, weights, prior, effects)
    alpha = 0.7 * _motion(robot, seed)
    if np.linalg.cond(objective.block(alpha)) < 3e3:
        steps = (1e-4, 3e-5, 1e-5, 3e-6)
        assert _error(objective, SmoothConditionNumber(6.0), alpha, steps) < 1e-6


def test_columns_are_torque_per_unit_in_the_rows_of_the_joint() -> None:
    robot = random_robot(5, joints=4)
    effects = [ViscousFriction((2,)), CoulombFriction((1,))]
    objective = _objective(robot, CriterionSpec(row_weights={"joint_3": 3.0}), False, effects)
    alpha = 0.7 * _motion(robot, 1)
    _, v, _ = objective.basis.states(alpha)
    assert objective.extension is not None
    block = objective.block(alpha).reshape(len(v), 4, -1)[:, :, -2:]
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
    y = Regressor(plain.robot).evaluate(q, v, a)[:, :, plain.base.selection]
    block = plain.objective().block(alpha)
    np.testing.assert_allclose(block, y.reshape(-1, plain.base.rank), atol=1e-12)
    np.testing.assert_array_equal(block, none.objective().block(alpha))


def test_what_no_motion_shows_is_left_out_with_the_reason() -> None:
    """The regressor has it already, single runs have it, or nothing that is measured shows it."""
    known = _problem("[{kind: armature, joints: [shoulder_yaw]}, {kind: viscous_friction}]")
    (reason,) = known.extension.left_out
    assert reason.startswith("armature on shoulder_yaw: collinear with")
    assert "Izz[shoulder_pitch]" in reason or "Izz[shoulder_yaw]" in reason
    assert len(known.extension.effects) == known.robot.n
    kinds = ("coulomb_friction", "asymmetric_friction", "torque_offset")
    twice = _problem(f"[{', '.join(f'{{kind: {kind}, joints: [elbow]}}' for kind in kinds)}]")
    left = (f"{kind} on elbow" for kind in kinds[1:])
    assert any(name in reason for name in left for reason in twice.extension.left_out)
    problem = _problem("[{kind: viscous_friction, joints: [elbow], runs: [a, b]}]")
    assert problem.extension.left_out == (
        "viscous_friction on elbow: it is present in recorded runs only (a, b)",
    )
    for name, kind in catalogue().items():
        if not kind.excitable and kind.scope != "base":
            column = ", covariate: temp" if kind.follows_covariate else ""
            (reason, *_) = _problem(f"[{{kind: {name}{column}}}]").extension.left_out
            assert kind.why_not_excitable in reason
    robot = random_robot(12, joints=3, floating=True, rows=("base",))
    base = find_base_parameters(robot)
    weighting = build_weighting(CriterionSpec(), robot, base)
    of_base = extend(robot, base, weighting, [ViscousFriction((0,))], 6.0)
    assert of_base.names == ()
    assert "none of its joints is a measured row" in of_base.left_out[0]


def test_time_derivatives_are_taken_on_the_fine_grid_with_the_same_weight() -> None:
    plain, late = _problem("[]"), _problem("[{kind: torque_delay}]")
    assert late.extension.fine
    assert len(late.cost_basis.times) == len(late.constraint_basis.times) == 120
    alpha, rank = drawn(plain, 0.3, 0), plain.base.rank
    coarse, fine = plain.objective().block(alpha), late.objective().block(alpha)[:, :rank]
    assert np.trace(fine.T @ fine) == pytest.approx(np.trace(coarse.T @ coarse), rel=0.02)
    assert check_gradient(late, repeats=2).passed


def test_too_few_samples_for_the_effects_too() -> None:
    with pytest.raises(ConfigError, match="26 base parameters and 10 of effects"):
        _problem("[{kind: viscous_friction},{kind: coulomb_friction}]",
                 "sampling.cost={samples: 7, step: 0.5}")  # fmt: skip


def test_a_motion_for_friction_shows_it_and_its_stack_fits_no_other_model() -> None:
    effects = "[{kind: viscous_friction}, {kind: coulomb_friction}]"
    problem = _problem(effects, "optimizer.max_iterations=25")
    result = planned(problem)
    (motion,) = result.motions
    block = problem.objective().block(motion.coefficients)
    assert motion.condition_number == pytest.approx(np.linalg.cond(block), rel=1e-6)
    assert motion.condition_number < 60
    assert result.effect_names[0] == "viscous_friction[shoulder_yaw].viscous"
    assert len(result.base_words) == len(result.column_scales) == problem.columns
    new_result(problem, [("a.h5", result)], {})
    for other, words in (
        ("[]", r"regressor has other effects .*here none"),
        ("[{kind: viscous_friction}]", r"coulomb_friction\[slide\]"),
    ):
        with pytest.raises(FileError, match=words):
            new_result(_problem(other), [("a.h5", result)], {})


def test_criteria_are_those_of_the_extended_matrix() -> None:
    problem = _problem("[{kind: spring}]")
    objective = problem.objective()
    alpha = problem.still(problem.robot.posture) + drawn(problem, 0.2, 4)
    block = objective.block(alpha)
    sigma = np.linalg.svd(block, compute_uv=False)
    assert block.shape[1] == problem.base.rank + 2 * problem.robot.n  # stiffness and preload
    criterion = build_criterion(CriterionSpec(kind="log_det"))
    assert objective.value(alpha, criterion) == pytest.approx(criterion.value(sigma), rel=1e-9)


def _directions(columns: int, true: list[int], other: list[int]) -> tuple[Direction, Direction]:
    rng = np.random.default_rng(1)
    found = []
    for own, rest in ((true, other), (other, true)):
        truth = np.zeros(columns)
        truth[own] = rng.uniform(0.5, 2.0, len(own))
        free = [i for i in range(columns) if i not in own]
        found.append(Direction((str(own), str(rest)), truth, np.array(free)))
    return found[0], found[1]


def test_divergence_is_half_the_squared_residual_of_least_squares() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(60, 9)) * np.geomspace(1, 1e3, 9)
    rows[:, 8] = 0.9 * rows[:, 7] + 0.1 * rows[:, 8]
    for direction in _directions(9, [7], [8]) + _directions(9, [5, 6], [8]):
        target = rows @ direction.truth
        x, _, _, _ = np.linalg.lstsq(rows[:, direction.free], target, rcond=None)
        expected = 0.5 * np.sum((target - rows[:, direction.free] @ x) ** 2)
        assert divergences(rows.T @ rows, [direction])[0] == pytest.approx(expected, rel=1e-8)
        _, z = residual_directions(rows.T @ rows, [direction])
        assert np.allclose(z[direction.free, 0], -x, rtol=1e-5, atol=1e-8 * np.abs(x).max())


def test_columns_that_no_row_shows_do_no_harm() -> None:
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(40, 6))
    first, second = _directions(6, [4], [5])
    whole = divergences(rows.T @ rows, (first, second))
    wide = np.hstack([rows[:, :4], np.zeros((40, 1)), rows[:, :1], rows[:, 4:]])
    wider = [
        Direction(
            d.pair,
            np.concatenate([d.truth[:4], [0.0, 0.0], d.truth[4:]]),
            np.array([*range(6), *(i + 2 for i in d.free if i >= 4)]),
        )
        for d in (first, second)
    ]
    assert np.allclose(divergences(wide.T @ wide, wider), whole, rtol=1e-6)


def _discrimination(seed: int, floating: bool, kinds: list[str]) -> Discrimination:
    rows = ("base", "joints") if floating else None
    robot = random_robot(seed, joints=3, floating=floating, branches=False, rows=rows)
    base = find_base_parameters(robot)
    spec = CriterionSpec(row_weights=dict.fromkeys(robot.row_names, 2.0))
    weighting = build_weighting(spec, robot, base)
    effects: list[Effect] = []
    for kind in kinds:
        shape, _ = catalogue()[kind].planted(1.0, {})
        place = (1,) if catalogue()[kind].scope == "joint" else catalogue()[kind].places(robot)[0]
        effects.append(catalogue()[kind](place, shape))
    extension = extend(robot, base, weighting, effects, 6.0, absorbed_too=True)
    size = base.rank + len(extension.names)
    last = len(effects[-1].parameters)
    own = list(range(size - last - len(effects[-2].parameters), size - last))
    directions = _directions(size, own, list(range(size - last, size)))
    basis = TRAJECTORY.basis(np.linspace(0, TRAJECTORY.duration, 60, endpoint=False))
    rng = np.random.default_rng(seed)
    earlier = Stack.empty(size).with_rows(0.3 * rng.normal(size=(2 * size, size)))
    separation = Separation(directions, earlier)
    parts = (robot, base, weighting, basis, earlier, extension)
    return Discrimination(*parts, separation=separation)


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize(
    "kinds",
    [
        ["viscous_friction", "nonlinear_viscous_friction"],
        ["coulomb_friction", "viscous_friction", "load_dependent_friction"],
        ["viscous_friction", "spring", "cable_force"],
        ["torque_delay", "armature"],
    ],
)
def test_the_envelope_gradient_is_exact(kinds: list[str], floating: bool) -> None:
    if floating and "torque_delay" in kinds:
        pytest.skip("its share in the base wrench is not modelled")
    objective = _discrimination(14, floating, kinds)
    rng = np.random.default_rng(6)
    alpha = 0.5 * rng.normal(size=(TRAJECTORY.n_coefficients, objective.robot.n))
    for criterion in (SmoothSigmaMin(4.0), SigmaMin()):
        _, gradient, spectrum = objective.value_and_gradient(alpha, criterion)
        assert np.linalg.norm(gradient) > 0
        assert np.all(np.diff(spectrum.sigma) <= 0)
        assert _error(objective, criterion, alpha, (3e-5, 1e-5, 3e-6)) < 1e-7
    assert spectrum.figure.measure is ProgressMeasure.DIVERGENCE
    factor = objective.stack.factor  # the earlier data alone
    expected = divergences(factor.T @ factor, objective.separation.directions)
    assert np.allclose(np.sort(0.5 * objective.earlier() ** 2), np.sort(expected))


def test_how_many_motions_it_takes() -> None:
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(50, 6))
    directions = _directions(6, [4], [5])
    motion, nothing = 1e-3 * rows.T @ rows, np.zeros((6, 6))
    count = motions_needed(nothing, motion, directions)
    assert count is not None
    assert divergences(count * motion, directions).min() >= SEPARATED
    assert divergences((count - 1) * motion, directions).min() < SEPARATED
    assert motions_needed(nothing, 1e-9 * motion, directions) is None
    assert motions_needed(nothing, 1e6 * motion, directions) == 1


def test_columns_of_unit_norm_have_it() -> None:
    problem = smoke()
    robot, base = problem.robot, problem.base
    scales = build_weighting(CriterionSpec(column_scaling="unit_norm"), robot, base).columns
    y = Regressor(robot).evaluate(*robot.draw_states(200, 0))[:, :, base.selection] * scales
    assert np.square(y).sum(axis=1).mean(axis=0) == pytest.approx(np.ones(base.rank))


def test_a_stack_with_another_has_the_rows_of_both() -> None:
    rows = np.random.default_rng(0).normal(size=(30, 3))
    one, other = (Stack.empty(3).with_rows(part) for part in (rows[:10], rows[10:]))
    both = one.with_stack(other)
    assert both.rows == 30
    assert both.factor.T @ both.factor == pytest.approx(rows.T @ rows)
