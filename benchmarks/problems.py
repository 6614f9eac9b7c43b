"""Problems the benchmarks share, and a motion to time them at."""

from pathlib import Path

import numpy as np

from excite_cli.config.load import load_spec
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.start import random_direction
from excite_cli.excitation.task import MotionTask

CONFIGS = Path(__file__).parents[1] / "configs"
WITHOUT_GEOMETRY = "constraints.self_collision=null"


def problem(name: str, *overrides: str) -> Problem:
    """A shipped config by its stem, with overrides."""
    path = CONFIGS / f"{name}.yaml"
    return build_problem(load_spec(path, list(overrides)), path.parent)


def motion(of: Problem, seed: int = 0) -> np.ndarray:
    """Coefficients of a seeded random motion of about the range of the joint bounds."""
    task = MotionTask(of)
    standing = task.variables(of.still(of.robot.posture))
    return task.coefficients(standing + 0.7 * random_direction(task, np.random.default_rng(seed)))
