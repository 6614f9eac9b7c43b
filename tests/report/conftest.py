from dataclasses import replace
from pathlib import Path

import pytest
from threadpoolctl import threadpool_limits

from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.run import continue_run, new_result
from tests.report.case import Case

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
QUICK = ["optimizer.max_iterations=10", "sequence.motions=1"]


def _silent(*_: object) -> None:
    """Say nothing about progress."""


@pytest.fixture(scope="session")
def case() -> Case:
    with threadpool_limits(limits=1):
        problem = build_problem(load_spec(CONFIG, QUICK), CONFIG.parent)
        result = continue_run(problem, new_result(problem, [], {}), lambda _: _silent, _silent)
        slower = 0.5 * result.motions[0].coefficients
        objective = problem.objective()
        own = objective.own_condition_number(slower)
    random = tuple(RandomMotion(i, slower, own, own) for i in (1, 2))
    return problem, replace(result, random=random, random_candidates=(30, 20))
