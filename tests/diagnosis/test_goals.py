"""What `sequence.until` asks for: reached, how far from it, and what no motions reach."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.expectation import expectation
from excite_cli.diagnosis.goals import Goals
from excite_cli.errors import ConfigError
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import new_result
from tests.excitation.smoke import planned, smoke

pytestmark = pytest.mark.long

KIND = "load_dependent_friction"


def asking(until: str, *more: str) -> Problem:
    """Motions for the work, or for the condition number where `more` says so."""
    criterion = () if more else ("criterion.kind=predicted_torque",)
    return smoke(f"sequence={{until: {{{until}}}}}", *criterion, *more)


@pytest.fixture(scope="module", params=["predicted_torque", "condition_number"])
def criterion(request: pytest.FixtureRequest) -> str:
    return f"criterion.kind={request.param}"


@pytest.fixture(scope="module")
def three(criterion: str) -> Result:
    return planned(smoke("sequence.motions=3", "optimizer.max_iterations=5", criterion))


def test_the_deviation_is_the_one_that_is_printed(criterion: str, three: Result) -> None:
    found = expectation(smoke(criterion), three).deviations[-1]
    for share, reached in ((1.001, True), (0.999, False)):
        goals = Goals(asking(f"predicted_deviation: {share * found}", criterion))
        (goal,) = goals.of(three)
        assert goals.reached(three) == reached
        assert goal.needed == pytest.approx(share**-2)
        assert f"standard deviation {found:.3g} σ" in goal.words
        assert f"(asked: {share * found:g})" in goal.words


@pytest.mark.parametrize("probability", [0.95, 0.6])
def test_power_is_reached_where_the_joint_that_lacks_most_has_it(
    criterion: str, three: Result, probability: float
) -> None:
    sizes = np.geomspace(0.008, 3.0, 8)
    chances = []
    for size in sizes:
        found = expectation(smoke(criterion), three, {KIND: float(size)}).power
        chances.append(min(each.power for each in found))
        until = f"power: {{{KIND}: {size}}}, probability: {probability}"
        goals = Goals(asking(until, criterion))
        (goal,) = goals.of(three)
        assert goals.reached(three) == (chances[-1] >= probability)
        assert (goal.needed <= 1.0) == (chances[-1] >= probability)
        assert goal.holds_out
    assert min(chances) < probability < max(chances)


def test_all_that_is_asked_for_has_to_be_reached(criterion: str, three: Result) -> None:
    both = Goals(asking(f"predicted_deviation: 100, power: {{{KIND}: 0.008}}", criterion))
    deviation, power = both.of(three)
    assert deviation.needed < 1.0 < power.needed
    assert not both.reached(three)
    assert Goals(asking("predicted_deviation: 100", criterion)).reached(three)


def test_a_joint_on_which_no_motion_shows_it_is_left_out_and_named() -> None:
    """The rotor of a vertical first axis, which the inertia of its link can stand for."""
    problem = asking("power: {armature: 1000}")
    two = ("sequence.motions=2", "optimizer.max_iterations=5")
    result = planned(smoke("criterion.kind=predicted_torque", *two))
    (goal,) = Goals(problem).of(result)
    assert goal.needed < 1.0
    assert f"no motion shows it on {problem.robot.joint_names[0]}" in goal.words


def test_data_that_show_nothing_are_not_precise() -> None:
    problem = asking("torque_deviation: 1000", "criterion.kind=condition_number")
    empty = new_result(problem, [], {})
    assert not Goals(problem).reached(empty)
    part = Stack.empty(problem.columns).with_rows(np.eye(problem.columns)[:2])
    assert not Goals(problem).reached(replace(empty, stack=part))
    full = Stack.empty(problem.columns).with_rows(np.eye(problem.columns))
    assert Goals(problem).reached(replace(empty, stack=full))


@pytest.mark.parametrize(
    ("until", "more", "words"),
    [
        ("efficiency: 0.5", ["criterion.of=load"], r"criterion\.of is load\. Leave"),
        ("power: {stiction: 1}", [], "sequence.until.power"),
        (f"power: {{{KIND}: 1.0e-6}}", [], "too small to matter on .* Ask for .* or more"),
        ("power: {contact: 1}", [], "contact: no planned motion shows it"),
    ],
)
def test_what_cannot_be_asked_for(until: str, more: list[str], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Goals(asking(until, *more))
