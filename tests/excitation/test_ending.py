"""Sequences that end once they are precise enough, or once their time is spent."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.api.planning import plan, plan_answer
from excite_cli.dynamics.regressor import Regressor
from excite_cli.errors import ConfigError
from excite_cli.excitation.ending import Ending
from excite_cli.excitation.problem import Problem, acceleration_bounds
from excite_cli.excitation.reference_states import state_bounds
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _problem(sequence: str, *more: str) -> Problem:
    quick = ["optimizer.max_iterations=10", "optimizer.restarts=1", "constraints.torque=null"]
    return load_problem(SMOKE, [*quick, f"sequence={sequence}", *more])


def _deviation(problem: Problem, result: Result, count: int) -> float:
    """RMS standard deviation of predicted torques from the first `count` motions, by pinv."""
    c = np.vstack([problem.objective().block(m.coefficients) for m in result.motions[:count]])
    bounds = acceleration_bounds(problem.spec, problem.robot)
    states = np.random.default_rng(0).uniform(
        *state_bounds(problem.robot, bounds), (500, 3 * problem.robot.n)
    )
    y = Regressor(problem.robot).evaluate(*np.split(states, 3, axis=1))[
        :, :, problem.base.selection
    ]
    rows = (y * problem.weighting.rows[:, None]).reshape(-1, problem.base.rank)
    rows = rows * problem.column_scales[: problem.base.rank]
    return float(np.sqrt(np.square(np.linalg.pinv(c).T @ rows.T).sum(axis=0).mean()))


def test_it_ends_with_the_first_motion_that_is_precise_enough() -> None:
    whole = _problem("{motions: 4}")
    four = plan(whole)
    deviations = [_deviation(whole, four, count) for count in (1, 2, 3, 4)]
    assert deviations == sorted(deviations, reverse=True)
    asked = 0.5 * (deviations[1] + deviations[2])
    problem = _problem(f"{{until: {{torque_deviation: {asked}}}}}")
    result = plan(problem)
    assert len(result.motions) == 3
    for own, other in zip(result.motions, four.motions, strict=False):
        np.testing.assert_array_equal(own.coefficients, other.coefficients)
    answer = plan_answer(problem, result, "x.h5")
    assert answer.good
    assert answer.data["until"] == {"reached": True, "seconds": 18.0}


def test_a_result_that_is_precise_enough_is_not_gone_on_with(tmp_path: Path) -> None:
    plan(_problem("{motions: 1}"), output=tmp_path / "a.h5")
    easy = _problem("{until: {torque_deviation: 1000, efficiency: 1e-6}}")
    assert len(plan(easy, output=tmp_path / "a.h5", resume=True).motions) == 1


def test_what_is_not_reached_is_said_first_and_is_bad() -> None:
    problem = _problem("{motions: 2, until: {torque_deviation: 1e-3, efficiency: 0.9}}")
    result = plan(problem)
    assert len(result.motions) == 2
    answer = plan_answer(problem, result, "x.h5")
    assert not answer.good
    first = answer.parts[0]
    assert isinstance(first, str)
    assert first.startswith(
        "sequence.until is NOT REACHED with 12 s of motion in all: predicted-torque"
    )
    assert "instead of 0.001 (about" in first
    assert "instead of 90 %" in first


def test_time_is_kept() -> None:
    assert Ending(_problem("{until: {duration: 12}}")).most == 2
    assert Ending(_problem("{until: {duration: 11.9}}")).most == 1
    assert Ending(_problem("{motions: 3, until: {duration: 1000}}")).most == 3
    assert Ending(_problem("{until: {torque_deviation: 1}}")).most == 20
    with pytest.raises(ConfigError, match="one motion takes 6 s, and the time of all is 5 s"):
        Ending(_problem("{until: {duration: 5}}"))


def test_a_load_has_no_precision_of_a_robot() -> None:
    with pytest.raises(ConfigError, match=r"criterion\.of is load\. Leave them out"):
        Ending(_problem("{until: {efficiency: 0.5}}", "criterion.of=load"))


def test_data_that_show_nothing_are_not_precise() -> None:
    problem = _problem("{until: {torque_deviation: 1000}}")
    result = plan(_problem("{motions: 1}"))
    rank = problem.columns
    nothing = Stack.empty(rank).with_rows(np.eye(rank)[:2])
    assert Ending(problem).reached(result)
    assert not Ending(problem).reached(replace(result, stack=nothing))
