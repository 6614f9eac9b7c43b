"""The smoke arm among things, with a motion that nobody had to optimise."""

from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.trajectory.fade import Segment

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
AROUND = [
    "constraints.surroundings={floor: -0.6, boxes: {shelf: {size: [0.2, 0.4, 0.05], "
    "position: [0.6, 0, 0.2]}}, walls: {left: {point: [0, 1.2, 0], normal: [0, -1, 0]}}}",
    "constraints.balance={kind: disc, radius: 0.2}",
    "robot.payload={link: tool, mass: 0.5, start: [0, 0, 0], end: [0, 0, 0.05], radius: 0.03}",
]


@pytest.fixture(scope="session")
def problem() -> Problem:
    with threadpool_limits(limits=1):
        return build_problem(load_spec(CONFIG, AROUND), CONFIG.parent)


@pytest.fixture(scope="session")
def segment(problem: Problem) -> Segment:
    coefficients = problem.still(problem.robot.posture)
    coefficients = coefficients + 0.15 * np.random.default_rng(3).normal(size=coefficients.shape)
    return Segment("motion_1", problem.trajectory, coefficients)
