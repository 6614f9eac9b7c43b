"""Motions as short as what is asked for allows: fewer seconds, no faster, gone on with."""

from pathlib import Path

import pytest

from excite_cli.api.motions import load_motions
from excite_cli.api.planning import as_planned, of_duration, plan, plan_answer
from excite_cli.diagnosis.goals import Goals
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.store.result_file import read_result
from tests.excitation.smoke import smoke

QUICK = ("criterion.kind=predicted_torque", "optimizer.max_iterations=20")
TWO = "sequence={motions: 2}"


def until(words: str, *more: str) -> Problem:
    return smoke(*QUICK, f"sequence={{{words}}}", *more)


def seconds(result: Result) -> list[float]:
    return [round(each.trajectory.duration, 6) for each in load_motions(smoke(), result)]


@pytest.fixture(scope="module")
def two() -> Result:
    return plan(smoke(*QUICK, TWO))


def between(two: Result) -> float:
    """A deviation that one motion of 6 s does not have, and two have with room."""
    first, second = (motion.predicted_deviation or 0.0 for motion in two.motions)
    return 0.75 * second + 0.25 * first


@pytest.mark.long
def test_what_is_asked_for_is_reached_in_fewer_seconds(two: Result, tmp_path: Path) -> None:
    problem = until(f"until: {{predicted_deviation: {between(two)}}}")
    result = plan(problem, output=tmp_path / "a.h5")
    assert sum(seconds(result)) < 0.95 * 12.0
    assert max(seconds(result)) < 6.0
    assert Goals(as_planned(problem, result)).reached(result)
    assert all(all(motion.certified.values()) for motion in result.motions)
    answer = plan_answer(problem, result, "a.h5")
    assert answer.good
    assert answer.data["until"] == {"reached": True, "seconds": pytest.approx(sum(seconds(result)))}
    assert any("sequence.until is reached with" in str(part) for part in answer.parts)
    stored = read_result(tmp_path / "a.h5")
    assert seconds(stored) == seconds(result)
    assert stored.config == result.config


@pytest.mark.parametrize("family", ["fourier", "bspline"])
def test_a_shorter_motion_is_no_faster_in_its_shape(family: str) -> None:
    changes = ("trajectory={family: bspline, duration: 6, control_points: 30}",)
    problem = smoke(*QUICK, *(changes if family == "bspline" else ("trajectory.harmonics=12",)))
    short = of_duration(problem, 3.0)
    assert short.trajectory.duration == pytest.approx(3.0)
    assert short.trajectory.n_coefficients < 0.6 * problem.trajectory.n_coefficients
    before, after = (each.constraint_basis.times for each in (problem, short))
    assert after[1] == pytest.approx(before[1])
    assert len(short.cost_basis.times) == len(problem.cost_basis.times)
    assert short.columns == problem.columns
    assert of_duration(problem, 6.001) is problem


@pytest.mark.parametrize(
    "words",
    ["motions: 2, until: {predicted_deviation: %s}", "until: {torque_deviation: %s}"],
)
def test_with_a_number_or_with_instants_that_count_the_duration_stays(
    words: str, two: Result
) -> None:
    assert seconds(plan(until(words % between(two)))) == [6.0, 6.0]


def test_not_in_the_time_of_all_the_duration_stays() -> None:
    problem = until("until: {predicted_deviation: 0.01, duration: 12}")
    result = plan(problem)
    assert seconds(result) == [6.0, 6.0]
    assert not plan_answer(problem, result, "a.h5").good


@pytest.mark.long
def test_an_interrupted_run_goes_on_with_motions_as_short(two: Result, tmp_path: Path) -> None:
    problem = until(f"until: {{predicted_deviation: {0.7 * between(two)}}}")
    path, planned = tmp_path / "a.h5", []

    def stop(index: int, state: object) -> None:
        planned.append(index)
        if planned.count(1) and index == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plan(problem, output=path, progress=stop)
    before = read_result(path)
    assert seconds(before)[0] < 6.0
    result = plan(problem, output=path, resume=True)
    assert set(seconds(result)) == set(seconds(before))
    assert len(result.motions) > 1
    assert Goals(as_planned(problem, result)).reached(result)
