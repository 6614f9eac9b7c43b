from dataclasses import replace

import pytest
from threadpoolctl import threadpool_limits

from excite_cli.excitation.random_baseline import RandomMotion
from tests.excitation.smoke import planned, smoke
from tests.report.case import Case

QUICK = ["optimizer.max_iterations=10", "sequence.motions=1"]


@pytest.fixture(scope="session")
def case() -> Case:
    with threadpool_limits(limits=1):
        problem = smoke(*QUICK)
        result = planned(problem)
        slower = 0.5 * result.motions[0].coefficients
        objective = problem.objective()
        own = objective.own_condition_number(slower)
    random = tuple(RandomMotion(i, slower, own, own) for i in (1, 2))
    return problem, replace(result, random=random, random_candidates=(30, 20))
