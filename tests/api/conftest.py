"""One small loop for all: motions of two joints, simulated data, a fit."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from excite_cli import Problem, identify, load_problem, plan, simulate

SMOKE = Path(__file__).resolve().parents[2] / "configs" / "smoke.yaml"
SMALL = (
    "optimizer.max_iterations=5",
    "constraints.self_collision=null",
    "robot.joints=[elbow, slide]",
)
OTHER = (*SMALL[:2], "robot.joints=[shoulder_yaw, elbow]")


@dataclass(frozen=True)
class Loop:
    """The problem, and the files that were made of it."""

    problem: Problem
    result: Path
    data: Path
    fit: Path


@pytest.fixture(scope="session")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Loop:
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
def other() -> Problem:
    """The same arm with another joint: its motions and data do not fit."""
    return load_problem(SMOKE, OTHER)
