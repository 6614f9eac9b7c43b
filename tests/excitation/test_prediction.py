"""Torques of the user's work: their variance, its gradient, and what motions would show."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.expectation import expectation
from excite_cli.errors import ConfigError
from excite_cli.excitation.gradient_check import check_gradient
from excite_cli.excitation.inspection import not_modelled
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.prediction import PredictedTorques
from excite_cli.excitation.problem import Problem, predicting
from tests.excitation.smoke import drawn, planned, smoke, stacked
from tests.excitation.smoke import prediction_of as of

FOR_WORK = "criterion.kind=predicted_torque"


@pytest.fixture(scope="module")
def problem() -> Problem:
    return smoke(FOR_WORK)


def test_the_gradient_is_that_of_differences(problem: Problem) -> None:
    assert check_gradient(problem).passed


def test_the_gradient_is_right_where_more_than_the_joints_is_measured() -> None:
    more = smoke(FOR_WORK, "robot.base=floating", "robot.rows=[base, joints]")
    assert check_gradient(more).passed


def test_the_deviation_is_that_of_drawn_parameters(problem: Problem) -> None:
    """Parameters drawn from the prior, fitted to noisy rows: torques are off by the deviation."""
    prediction, rng = of(problem), np.random.default_rng(5)
    block = problem.objective().block(drawn(problem, 0.3, 1))
    prior = prediction.prior
    information = block.T @ block + prior.T @ prior
    off = []
    for _ in range(400):
        z = np.linalg.solve(prior, rng.normal(size=len(prior)))
        rows = block @ z + rng.normal(size=len(block))
        off.append(prediction.work @ (np.linalg.solve(information, block.T @ rows) - z))
    measured = np.sqrt(np.mean(np.square(off)))
    told = prediction.deviation(Stack.empty(problem.columns).with_rows(block).factor)
    assert told == pytest.approx(measured, rel=0.05)


def test_the_criterion_is_the_logarithm_of_the_deviation(problem: Problem) -> None:
    alpha, objective = drawn(problem, 0.3, 1), problem.objective()
    assert isinstance(objective, PredictedTorques)
    factor = stacked(problem, 1).factor
    value = objective.value(alpha, problem.criterion)
    assert value == pytest.approx(np.log(of(problem).deviation(factor)), abs=1e-9)


def test_motions_make_it_smaller_and_earlier_data_count(problem: Problem) -> None:
    deviations = [of(problem).deviation(stacked(problem, *range(k)).factor) for k in range(4)]
    assert np.all(np.diff(deviations) < 0)
    on_top = problem.objective(stacked(problem, 0)).value(drawn(problem, 0.3, 1), problem.criterion)
    assert on_top == pytest.approx(np.log(of(problem).deviation(stacked(problem, 0, 1).factor)))


def test_slow_work_is_predicted_better_and_needs_no_other_columns(problem: Problem) -> None:
    slow = smoke(FOR_WORK, "task={speed: 0.2, acceleration: 0.1}")
    factor = stacked(problem, 1).factor
    assert of(slow).deviation(factor) < of(problem).deviation(factor)


def test_a_longer_motion_of_as_many_instants_tells_more() -> None:
    one, other = (of(smoke(FOR_WORK, f"task.rate={rate}")) for rate in (20, 80))
    assert other.weighting.rows == pytest.approx(2.0 * one.weighting.rows)


def test_weights_of_rows_are_the_noise_that_somebody_knows() -> None:
    known = of(smoke(FOR_WORK, "criterion.row_weights={elbow: 4.0}"))
    usual = of(smoke(FOR_WORK))
    changed = known.weighting.rows / usual.weighting.rows
    assert np.count_nonzero(np.abs(changed - 1.0) > 1e-9) == 1


def test_condition_numbers_are_those_of_the_criterion_with_that_name(problem: Problem) -> None:
    plain = smoke("sequence.motions=1").objective()
    stack, own = Stack.empty(plain.size), Stack.empty(problem.columns)
    for seed in (1, 2):
        alpha = drawn(problem, 0.3, seed)
        plain, objective = smoke("sequence.motions=1").objective(stack), problem.objective(own)
        for name in ("own_condition_number", "stacked_condition_number"):
            wanted = getattr(plain, name)(alpha)
            assert getattr(objective, name)(alpha) == pytest.approx(wanted, rel=1e-6)
        stack, own = plain.added_to(stack, alpha), objective.added_to(own, alpha)


@pytest.mark.long
def test_planned_for_the_work_it_is_predicted_better() -> None:
    for_work, for_condition = (
        planned(smoke(f"criterion.kind={kind}", "sequence.motions=1"))
        for kind in ("predicted_torque", "condition_number")
    )
    judged = smoke(FOR_WORK)
    found = [expectation(judged, each).deviations[-1] for each in (for_work, for_condition)]
    assert found[0] < 0.9 * found[1]


def test_figures_are_the_same_whatever_the_motions_were_planned_for(problem: Problem) -> None:
    result = planned(smoke("sequence.motions=1", "optimizer.max_iterations=5"))
    plain = smoke("sequence.motions=1")
    assert expectation(plain, result).deviations == pytest.approx(
        expectation(problem, result).deviations
    )


def test_kinds_that_are_rare_are_in_where_somebody_asks(problem: Problem) -> None:
    assert "spring" not in {each.kind for each in problem.extension.effects}
    wide = predicting(problem, ("spring",))
    assert "spring" in {each.kind for each in wide.extension.effects}


def test_an_effect_that_no_motion_shows_is_refused_with_the_reason(problem: Problem) -> None:
    with pytest.raises(ConfigError, match="backlash: no planned motion shows it"):
        predicting(problem, ("backlash",))


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("task={position: {elbw: [0, 1]}}", "no moved joint 'elbw'. Did you mean 'elbow'"),
        ("task={position: {elbow: [1, 0]}}", "task.position.elbow: 1 is above 0"),
        ("task={log: a.h5, speed: 0.5}", "log and position, speed, acceleration exclude"),
        ("task={effects: [stribek_friction]}", "task.effects: there is no effect"),
        ("task={plan: none.csv}", "task.plan: there is no file"),
    ],
)
def test_a_task_that_cannot_be_says_why(setting: str, told: str) -> None:
    with pytest.raises(Exception, match="task") as refused:
        smoke(FOR_WORK, setting)
    assert told in str(refused.value)


# What no constraint knows of.


def test_what_is_not_modelled_is_named() -> None:
    bare = smoke("constraints={}")
    assert [text.split(" (")[0] for text in not_modelled(bare)][:2] == [
        "the floor and all else around the robot",
        "the robot's own links",
    ]
    floor = smoke("constraints.surroundings={floor: -1.0}")
    cables = "cables, hoses and tools that are not in the URDF"
    assert not_modelled(floor) == (
        "all around the robot but the floor (constraints.surroundings)",
        cables,
    )
    both = "{floor: -1.0, walls: {behind: {point: [-2, 0, 0], normal: [1, 0, 0]}}}"
    assert not_modelled(smoke(f"constraints.surroundings={both}")) == (cables,)
    wall = "{walls: {behind: {point: [-2, 0, 0], normal: [1, 0, 0]}}}"
    assert "the floor" in not_modelled(smoke(f"constraints.surroundings={wall}"))[0]


def test_a_separation_has_no_prediction_beside_it(problem: Problem) -> None:
    assert predicting(replace(problem, prediction=None)).separation is None
