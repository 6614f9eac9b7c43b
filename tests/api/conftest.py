from dataclasses import dataclass
from pathlib import Path

import pytest

from excite_cli import (
    Case,
    Problem,
    Result,
    identify,
    load_case,
    load_problem,
    plan,
    simulate,
)

ROOT = Path(__file__).resolve().parents[2]
SMOKE, UR10 = ROOT / "configs" / "smoke.yaml", ROOT / "configs" / "ur10.yaml"
SMALL = ["optimizer.max_iterations=5", "constraints={}", "robot.joints=[elbow, slide]"]
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


@dataclass(frozen=True)
class Loop:
    """A problem of two joints, and the files that were made of it."""

    problem: Problem
    result: Path
    data: Path
    fit: Path


@pytest.fixture(scope="session")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Loop:
    """Two motions, simulated and identified."""
    folder = tmp_path_factory.mktemp("loop")
    made = Loop(
        load_problem(SMOKE, [*SMALL, "sequence.motions=2"]),
        folder / "arm.h5",
        folder / "data.h5",
        folder / "fit.h5",
    )
    plan(made.problem, output=made.result)
    simulate(made.problem, made.result, ["coulomb_friction@elbow=2"], output=made.data)
    identify(made.problem, made.data, output=made.fit)
    return made


@pytest.fixture(scope="session")
def other_joints() -> Case:
    """The same arm with another joint: motions and data of the loop do not fit."""
    return load_case(SMOKE, ["robot.joints=[shoulder_yaw, elbow]"])
