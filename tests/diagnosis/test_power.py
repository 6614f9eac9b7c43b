"""Sizes of effects that a diagnosis of planned motions would name, and how probably."""

import numpy as np
import pytest
from scipy.stats import chi2

from excite_cli.diagnosis import rules
from excite_cli.diagnosis.expectation import expectation, rows_as_recorded
from excite_cli.diagnosis.power import power_of, price, sizes_shown, times_named
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from tests.excitation.smoke import drawn, planned, smoke, stacked
from tests.excitation.smoke import prediction_of as of

FOR_WORK = "criterion.kind=predicted_torque"


@pytest.fixture(scope="module")
def problem() -> Problem:
    return smoke(FOR_WORK)


def test_an_effect_of_the_size_told_is_found_as_often_as_told(problem: Problem) -> None:
    """By a likelihood ratio on drawn data, against the price, beside inertias and a textbook."""
    prediction, rng = of(problem), np.random.default_rng(3)
    block = problem.objective().block(drawn(problem, 0.3, 1))
    stack = Stack.empty(problem.columns).with_rows(block)
    kind = "load_dependent_friction"
    at = next(k for k, e in enumerate(prediction.extension.effects) if e.kind == kind)
    column = int(prediction.first_columns[at])
    shown = sizes_shown(prediction, stack, 0.01, power=0.8)[at]
    size = shown.size / prediction.extension.scales[column - prediction.rank]
    textbook = ("viscous_friction", "coulomb_friction", "torque_offset", "armature")
    friction = [
        int(first)
        for first, each in zip(prediction.first_columns, prediction.extension.effects, strict=True)
        if each.kind in textbook
    ]
    beside = [*range(prediction.rank), *friction]
    prior = np.eye(len(beside) + 1)[prediction.rank : -1]
    both = np.vstack([block[:, [*beside, column]], prior])
    named = 0
    for _ in range(400):
        z = np.append(rng.normal(size=len(beside)), size)
        rows = block[:, [*beside, column]] @ z + rng.normal(size=len(block))
        rows = np.append(rows, np.zeros(len(prior)))
        saved = _left(both[:, :-1], rows) - _left(both, rows)
        named += saved > price(kind_named(kind), 0.01)
    assert named / 400 == pytest.approx(0.8, abs=0.06)


def _left(matrix: np.ndarray, rows: np.ndarray) -> float:
    solution = np.linalg.lstsq(matrix, rows, rcond=None)[0]
    return float(np.sum(np.square(rows - matrix @ solution)))


def test_the_probability_of_a_size_goes_with_the_size_of_a_probability(problem: Problem) -> None:
    prediction, stack = of(problem), stacked(problem, 1)
    for each in sizes_shown(prediction, stack, 0.01):
        if np.isfinite(each.size):
            same = power_of(prediction, stack, 0.01, each.kind, each.size)
            own = next(one for one in same if one.joints == each.joints)
            assert own.power > 0.95 - 1e-6
            assert own.power < 0.95 + 1e-6 or own.share < 1.001 * rules.SMALLEST


def test_more_motions_show_smaller_effects_and_none_show_nothing(problem: Problem) -> None:
    prediction = of(problem)
    few, more = (sizes_shown(prediction, stacked(problem, *s), 0.01) for s in ((1,), (1, 2, 3)))
    assert all(a.size >= b.size for a, b in zip(few, more, strict=True))
    assert sum(a.size > b.size for a, b in zip(few, more, strict=True)) > 20
    none = sizes_shown(prediction, Stack.empty(problem.columns), 0.01)
    assert all(np.isinf(each.size) for each in none)


def test_what_surprises_more_costs_more() -> None:
    kinds = catalogue()
    dear, cheap = kinds["spring"], kinds["viscous_friction"]
    assert price(dear, 0.01) - price(cheap, 0.01) == pytest.approx(dear.prior_cost)
    assert price(cheap, 0.01) > chi2.isf(0.01, 1)


def test_of_a_huge_size_the_power_is_one(problem: Problem) -> None:
    for each in power_of(of(problem), stacked(problem, 1), 0.01, "torque_offset", 1e9):
        assert each.power == pytest.approx(1.0)


def test_times_named_are_those_of_the_chance() -> None:
    for power in (0.2, 0.5, 0.95):
        times = times_named(20.0, power)
        drawn_ = np.random.default_rng(1).normal(times, 1.0, 200_000)
        assert np.mean(drawn_**2 > 20.0) == pytest.approx(power, abs=5e-3)


def test_what_is_too_small_to_matter_is_not_named_however_surely_it_is_there(
    problem: Problem,
) -> None:
    prediction = of(problem)
    many = stacked(problem, *range(1, 4))
    sure = Stack(1e3 * many.factor, many.rows)
    for each in sizes_shown(prediction, sure, 0.01):
        if np.isfinite(each.size):
            assert each.share >= rules.SMALLEST * (1 - 1e-9)
            (less,) = (
                one
                for one in power_of(prediction, sure, 0.01, each.kind, 0.99 * each.size)
                if one.joints == each.joints
            )
            assert less.power == 0.0 or each.share > 1.01 * rules.SMALLEST


def test_a_rotor_that_the_inertia_can_stand_for_is_not_shown() -> None:
    """That of a vertical first axis: only what is known of the link's inertia speaks of it."""
    found = expectation(problem := smoke(FOR_WORK, "sequence.motions=1"), planned(problem))
    first = problem.robot.joint_names[0]
    alone = {each.joints: each for each in found.power if each.kind == "armature"}
    assert alone[first,].share > 10.0


def test_the_last_of_several_motions_is_held_out(problem: Problem) -> None:
    two = planned(smoke(FOR_WORK, "sequence.motions=2", "optimizer.max_iterations=5"))
    found = expectation(problem, two)
    rows = rows_as_recorded(problem, problem.objective(), two.motions[0].coefficients)
    alone = Stack.empty(problem.columns).with_rows(rows)
    assert found.power == sizes_shown(of(problem), alone, problem.spec.diagnosis.significance)
