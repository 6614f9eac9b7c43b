"""Motions in sequence, the random baseline, and what the records say of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.excitation.admissible import verdicts, worst_margins
from excite_cli.excitation.gradient_check import check_gradient
from excite_cli.excitation.objective import Objective
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.random_baseline import RandomBaseline, random_baseline
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.stack import Stack

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _problem(*settings: str) -> Problem:
    common = ["optimizer.max_iterations=40", "constraints.torque=null"]
    return build_problem(load_spec(CONFIG, [*common, *settings]), CONFIG.parent)


def _run(problem: Problem) -> Result:
    return continue_run(
        problem,
        new_result(problem, [], {}),
        lambda index: lambda progress: None,
        lambda step, current: None,
    )


@pytest.fixture(scope="module")
def problem() -> Problem:
    return _problem("sequence.motions=3")


@pytest.fixture(scope="module")
def result(problem: Problem) -> Result:
    return _run(problem)


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
    last = np.linalg.cond(result.stack.factor)
    assert last == pytest.approx(result.motions[-1].stacked_condition_number, rel=1e-8)


def test_every_motion_is_admissible_on_a_grid_of_its_own(problem: Problem, result: Result) -> None:
    for motion in result.motions:
        margins = worst_margins(problem, motion.coefficients, 1731.0)
        assert all(worst.violations == 0 for worst in margins.values())
        found = verdicts(problem, motion.coefficients)
        assert len(found) == len(problem.constraints)
        assert all(verdict.proved for verdict in found)
        assert motion.certified == {verdict.name: True for verdict in found}


def test_a_later_motion_knows_the_earlier_ones(problem: Problem, result: Result) -> None:
    first, second, _ = result.motions
    assert second.stacked_condition_number < first.stacked_condition_number
    assert not np.allclose(first.coefficients, second.coefficients)


def test_a_motion_that_adds_nothing_is_called_so(problem: Problem) -> None:
    """On top of a thousand excellent motions, one more cannot matter."""
    perfect = Stack(1e6 * np.eye(problem.base.rank), 1)
    start = new_result(problem, [], {})
    fixed = Result(**{**vars(start), "stack": perfect, "prior_stack": perfect})
    one = _problem("sequence.motions=1")
    final = continue_run(one, fixed, lambda i: lambda p: None, lambda step, current: None)
    assert not final.motions[0].improved
    assert final.motions[0].stacked_condition_number == pytest.approx(1.0, abs=1e-3)


def test_restarts_never_do_worse(problem: Problem) -> None:
    one, three = (_run(_problem("sequence.motions=1", f"optimizer.restarts={n}")) for n in (1, 3))
    best, single = three.motions[0], one.motions[0]
    assert best.condition_number <= single.condition_number * (1 + 1e-12)


def test_random_motions_are_admissible_and_rightly_numbered(
    problem: Problem, baseline: RandomBaseline
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


def test_optimised_motions_beat_random_ones(result: Result, baseline: RandomBaseline) -> None:
    optimised, random = result.motions[-1], baseline.motions[-1]
    assert 2.5 * optimised.stacked_condition_number < random.stacked_condition_number


def test_more_candidates_are_drawn_while_time_is_left(problem: Problem) -> None:
    found = random_baseline(problem, 1, 1, 2, 0.5, lambda drawn, best: None)
    assert found.candidates > 2


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
