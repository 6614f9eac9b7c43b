"""What planned motions are expected to tell: torques of the work, and effects that would show.

The same figures whatever the motions were planned for, and with whatever weights.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from excite_cli.diagnosis.power import EffectPower, power_of, sizes_shown
from excite_cli.excitation.objective import Objective, Stack
from excite_cli.excitation.problem import Problem, predicting
from excite_cli.excitation.result import Result
from excite_cli.robot.model import Array
from excite_cli.trajectory.base import Trajectory

_FINER = 10  # instants in the time of a sample


@dataclass(frozen=True)
class Expectation:
    """`deviations`: after each motion, with all before it, the RMS standard deviation of a torque
    of the work in units of the noise of one sample; `power`: of the effects, in a diagnosis of all
    of them that holds the last out, if there are two or more recordings.

    `all_data`: whether earlier data (`--prior`) are in these figures.
    """

    deviations: tuple[float, ...]
    power: tuple[EffectPower, ...]
    all_data: bool = True


def expectation(
    problem: Problem,
    result: Result,
    asked: Mapping[str, float] | None = None,
    known: tuple[Problem, Stack] | None = None,
) -> Expectation:
    """Of the motions in `result`; `asked`: sizes, by kind, whose power is asked for.

    `known`: a problem with a prediction, and earlier data on its columns.

    Raises
    ------
    ConfigError
        No planned motion shows an effect that is asked for.
    """
    asked = asked or {}
    start, earlier = known or (problem, result.prior_stack)
    own = predicting(start, tuple(asked))
    prediction = own.prediction
    assert prediction is not None
    same = own is start and earlier.factor.shape[1] == own.columns
    stack = earlier if same else Stack.empty(own.columns)
    objective, deviations, fitted = own.objective(), [], stack
    for motion in result.motions:
        stack = objective.added_to(stack, motion.coefficients)
        deviations.append(prediction.deviation(stack.factor))
    last = len(result.motions) > 1 or (earlier.rows > 0 and same)
    for motion in result.motions[: len(result.motions) - last]:
        fitted = fitted.with_rows(rows_as_recorded(own, objective, motion.coefficients))
    alpha = problem.spec.diagnosis.significance
    power = tuple(
        each
        for kind, size in asked.items()
        for each in power_of(prediction, fitted, alpha, kind, size)
    )
    return Expectation(
        tuple(deviations),
        power if asked else sizes_shown(prediction, fitted, alpha),
        same or not earlier.rows,
    )


def rows_as_recorded(
    problem: Problem,
    objective: Objective,
    coefficients: Array,
    trajectory: Trajectory | None = None,
) -> Array:
    """Rows (N·R, c) of a motion as its recording has them, in units of the noise.

    `task.rate` independent samples a second are means over as long: of a column that lasts for less
    (Stribeck friction at a reversal) they show less. `trajectory`: of a motion that has another
    than the problem's.
    """
    trajectory, rate = trajectory or problem.trajectory, problem.spec.task.rate
    count = max(1, int(rate * trajectory.duration))
    times: Array = np.arange(count * _FINER) / (rate * _FINER)
    states = trajectory.states(times, coefficients)
    block = objective.block_of(times, *states)
    means = block.reshape(count, _FINER, -1, block.shape[1]).mean(axis=1)
    weight = np.sqrt(rate * problem.trajectory.duration / len(problem.cost_basis.times))
    return np.asarray(means.reshape(-1, block.shape[1]) / weight)
