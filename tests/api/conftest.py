from pathlib import Path

import pytest

from excite_cli import Case, Problem, Result, load_case, load_problem, plan

ROOT = Path(__file__).resolve().parents[2]
SMOKE, UR10 = ROOT / "configs" / "smoke.yaml", ROOT / "configs" / "ur10.yaml"
BRIEF = ["optimizer.max_iterations=6", "sequence.motions=1", "constraints.self_collision=null"]


@pytest.fixture(scope="session")
def problem() -> Problem:
    return load_problem(SMOKE, BRIEF)


@pytest.fixture(scope="session")
def stored(problem: Problem, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result file of the small arm."""
    path = tmp_path_factory.mktemp("api") / "arm.h5"
    plan(problem, output=path)
    return path


@pytest.fixture(scope="session")
def result(problem: Problem, stored: Path) -> Result:
    from excite_cli import read_result

    return read_result(stored)


@pytest.fixture(scope="session")
def other() -> Problem:
    """The problem of another robot."""
    return load_problem(UR10, ["constraints={}"])


@pytest.fixture(scope="session")
def other_case() -> Case:
    return load_case(UR10)
