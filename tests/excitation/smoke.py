"""The arm of the examples: problems, motions and results of it, made in a moment."""

from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.api.loading import load_problem
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.prediction import Prediction
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.sequence import generate_motion
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.task import MotionTask
from excite_cli.robot.model import Array

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def smoke(*changes: str) -> Problem:
    return load_problem(CONFIG, changes)


def task_of(*changes: str) -> MotionTask:
    return MotionTask(smoke(*changes))


def drawn(problem: Problem, size: float, seed: int = 3) -> Array:
    """Random coefficients."""
    shape = (problem.trajectory.n_coefficients, problem.robot.n)
    return size * np.random.default_rng(seed).normal(size=shape)


def prediction_of(problem: Problem) -> Prediction:
    assert problem.prediction is not None
    return problem.prediction


def stacked(problem: Problem, *seeds: int) -> Stack:
    """Of random motions."""
    objective, stack = problem.objective(), Stack.empty(problem.columns)
    for seed in seeds:
        stack = objective.added_to(stack, drawn(problem, 0.3, seed))
    return stack


def one_motion(problem: Problem) -> Motion:
    stack = Stack.empty(problem.columns)
    return generate_motion(problem, InteriorPoint(), stack, 1, 1, lambda progress: None)


def planned(problem: Problem, begin: Result | None = None, **more: Any) -> Result:
    """The sequence of the config, after `begin`; nobody is told of it."""
    begin = begin or new_result(problem, [], {})
    more.setdefault("report", lambda index: lambda progress: None)
    return continue_run(problem, begin, more.pop("report"), lambda step, result: None, **more)
