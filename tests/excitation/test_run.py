"""Motions in sequence: grids, stacked figures, the random baseline, and when a sequence ends."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.api.planning import plan, plan_answer
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.regressor import Regressor
from excite_cli.errors import ConfigError
from excite_cli.excitation.admissible import verdicts, worst_margins
from excite_cli.excitation.gradient_check import check_gradient
from excite_cli.excitation.objective import Objective, Stack
from excite_cli.excitation.problem import (
    Problem,
    acceleration_bounds,
    instants,
    with_sampling,
)
from excite_cli.excitation.random_baseline import RandomBaseline, random_baseline
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import new_result
from excite_cli.excitation.sequence import motions_within
from excite_cli.excitation.weighting import state_bounds
from excite_cli.trajectory.base import with_freedom
from excite_cli.trajectory.catalogue import build_trajectory
from tests.excitation.smoke import planned, smoke


def _problem(*settings: str) -> Problem:
    return smoke("optimizer.max_iterations=40", "constraints.torque=null", *settings)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return _problem("sequence.motions=3")


@pytest.fixture(scope="module")
def result(problem: Problem) -> Result:
    return planned(problem)


@pytest.fixture(scope="module")
def baseline(problem: Problem) -> RandomBaseline:
    return random_baseline(problem, 3, 1, 40, 0.0, lambda drawn, best: None)


def test_stacked_numbers_are_those_of_all_rows_so_far(problem: Problem, result: Result) -> None:
    objective, rows = problem.objective(), []
    for motion in result.motions:
        rows.append(objective.block(motion.coefficients))
        assert motion.condition_number == pytest.approx(np.linalg.cond(rows[-1]), rel=1e-8)
        whole = np.linalg.cond(np.vstack(rows))
        assert motion.stacked_condition_number == pytest.approx(whole, rel=1e-8)
    assert np.linalg.cond(result.stack.factor) == pytest.approx(whole, rel=1e-8)
    first, second, _ = result.motions
    assert second.stacked_condition_number < first.stacked_condition_number
    assert not np.allclose(first.coefficients, second.coefficients)


def test_every_motion_is_admissible_on_a_grid_of_its_own(problem: Problem, result: Result) -> None:
    for motion in result.motions:
        margins = worst_margins(problem, motion.coefficients, 1731.0)
        assert all(worst.violations == 0 for worst in margins.values())
        found = verdicts(problem, motion.coefficients)
        assert len(found) == len(problem.constraints)
        assert all(verdict.proved for verdict in found)
        assert motion.certified == {verdict.name: True for verdict in found}


def test_a_motion_that_adds_nothing_is_called_so(problem: Problem) -> None:
    """On top of a thousand excellent motions, one more cannot matter."""
    perfect = Stack(1e6 * np.eye(problem.base.rank), 1)
    begin = replace(new_result(problem, [], {}), stack=perfect, prior_stack=perfect)
    (motion,) = planned(_problem("sequence.motions=1"), begin).motions
    assert not motion.improved
    assert motion.stacked_condition_number == pytest.approx(1.0, abs=1e-3)


def test_restarts_never_do_worse(problem: Problem) -> None:
    one, three = (
        planned(_problem("sequence.motions=1", f"optimizer.restarts={n}")) for n in (1, 3)
    )
    best, single = three.motions[0], one.motions[0]
    assert best.condition_number <= single.condition_number * (1 + 1e-12)


def test_random_motions_are_admissible_rightly_numbered_and_worse(
    problem: Problem, baseline: RandomBaseline, result: Result
) -> None:
    assert baseline.candidates >= 40
    assert 0 < baseline.admissible <= baseline.candidates
    rows = []
    for motion in baseline.motions:
        margins = worst_margins(problem, motion.coefficients, 500.0)
        assert all(worst.margin > -1e-3 for worst in margins.values())
        rows.append(problem.objective().block(motion.coefficients))
        whole = np.linalg.cond(np.vstack(rows))
        assert motion.stacked_condition_number == pytest.approx(whole, rel=1e-6)
    assert 2.5 * result.motions[-1].stacked_condition_number < whole
    longer = random_baseline(problem, 1, 1, 2, 0.5, lambda drawn, best: None)
    assert longer.candidates > 2, "more are drawn while time is left"


@pytest.mark.parametrize("prior", [False, True])
def test_gradient_check_passes_and_can_fail(
    problem: Problem, result: Result, prior: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stack = result.stack if prior else None
    assert check_gradient(problem, stack=stack, repeats=2).passed
    exact = Objective._by_states

    def wrong(self: Objective, *arguments: Any) -> tuple:
        gq, gv, ga = exact(self, *arguments)
        return gq, gv * (1 + 1e-6), ga

    monkeypatch.setattr(Objective, "_by_states", wrong)
    assert not check_gradient(problem, stack=stack, repeats=2).passed


def short(sequence: str, *more: str) -> Problem:
    quick = ("optimizer.max_iterations=10", "optimizer.restarts=1", "constraints.torque=null")
    return smoke(*quick, f"sequence={sequence}", *more)


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
    whole = short("{motions: 4}")
    four = plan(whole)
    deviations = [_deviation(whole, four, count) for count in (1, 2, 3, 4)]
    assert deviations == sorted(deviations, reverse=True)
    asked = 0.5 * (deviations[1] + deviations[2])
    problem = short(f"{{until: {{torque_deviation: {asked}}}}}")
    result = plan(problem)
    assert len(result.motions) == 3
    for own, other in zip(result.motions, four.motions, strict=False):
        np.testing.assert_array_equal(own.coefficients, other.coefficients)
    answer = plan_answer(problem, result, "x.h5")
    assert answer.good
    assert answer.data["until"] == {"reached": True, "seconds": 18.0}


def test_what_is_not_reached_is_said_first_and_is_bad() -> None:
    problem = short("{motions: 2, until: {torque_deviation: 1e-3, efficiency: 0.9}}")
    result = plan(problem)
    assert len(result.motions) == 2
    answer = plan_answer(problem, result, "x.h5")
    assert not answer.good
    first = answer.parts[0]
    assert isinstance(first, str)
    assert first.startswith(
        "sequence.until is NOT REACHED with 12 s of motion in all: predicted-torque"
    )
    assert "(asked: 0.001)" in first
    assert "(asked: 90 %)" in first


@pytest.mark.parametrize(
    ("sequence", "most"),
    [
        ("{until: {duration: 12}}", 2),
        ("{until: {duration: 11.9}}", 1),
        ("{motions: 3, until: {duration: 1000}}", 3),
        ("{until: {torque_deviation: 1}}", 20),
    ],
)
def test_time_is_kept(sequence: str, most: int) -> None:
    assert motions_within(short(sequence)) == most


def test_a_time_that_is_shorter_than_a_motion_is_refused() -> None:
    with pytest.raises(ConfigError, match="one motion takes 6 s, and the time of all is 5 s"):
        motions_within(short("{until: {duration: 5}}"))


def _filled(text: str) -> Spec:
    spec = parse_spec(f"robot: {{urdf: a}}\n{text}")
    spec = spec.model_copy(update={"trajectory": with_freedom(spec.trajectory, np.full(2, 10.0))})
    return with_sampling(spec, build_trajectory(spec.trajectory))


@pytest.mark.parametrize(
    "text",
    [
        "trajectory: {family: bspline, duration: 12}",
        "trajectory: {harmonics: 3, base_frequency: 1.0}",
        "trajectory: {harmonics: 20, base_frequency: 0.1}",
        "trajectory: {family: bspline, duration: 0.5}\nsampling: {cost: {samples: 30}}",
        "trajectory: {base_frequency: 0.5}\nsampling: {constraints: {step: 0.05}}",
    ],
)
def test_default_grids_cover_the_trajectory_exactly(text: str) -> None:
    spec = _filled(text)
    trajectory = build_trajectory(spec.trajectory)
    for grid in (spec.sampling.cost, spec.sampling.constraints):
        times = instants(grid)
        assert times[0] == 0
        assert times[-1] < trajectory.duration
        covered = times[-1] + times[1]
        assert covered == pytest.approx(trajectory.duration, rel=0.05)
    times = instants(spec.sampling.constraints)
    assert np.diff(times)[0] <= max(0.0201, trajectory.duration / 1000) or "step" in text
    assert len(instants(spec.sampling.cost)) >= min(30, trajectory.n_coefficients)
    given = _filled("sampling: {cost: {samples: 40, step: 0.2}, constraints: {samples: 400}}")
    assert (given.sampling.cost.samples, given.sampling.cost.step) == (40, 0.2)
    assert given.sampling.constraints.step == pytest.approx(0.02, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "trajectory: {base_frequency: 0.5}\n"
            "sampling: {constraints: {samples: 400, step: 0.02}}",
            "cover 8 s of a trajectory of 12.5664 s; the constraints would not hold in",
        ),
        ("sampling: {cost: {samples: 100, step: 0.2}}", "last longer than the trajectory"),
        ("trajectory: {base_frequency: 1.0e-4}", "longer than the 3600 s"),
    ],
)
def test_grids_that_do_not_fit_are_refused(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        _filled(text)


def test_a_result_that_is_precise_enough_is_not_gone_on_with(tmp_path: Path) -> None:
    problem = short("{until: {torque_deviation: 1000, efficiency: 1e-6}}")
    plan(short("{motions: 1}"), output=tmp_path / "a.h5")
    assert len(plan(problem, output=tmp_path / "a.h5", resume=True).motions) == 1
