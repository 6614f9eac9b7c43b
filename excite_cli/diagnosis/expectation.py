"""What planned motions are expected to tell: torques of the work, and effects that would show.

The same figures whatever the motions were planned for, and with whatever weights.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from excite_cli.diagnosis.power import EffectPower, power_of, sizes_shown
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.with_prediction import predicting


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
    objective, deviations, stacks = own.objective(), [], [stack]
    for motion in result.motions:
        stacks.append(objective.added_to(stacks[-1], motion.coefficients))
        deviations.append(prediction.deviation(stacks[-1].factor))
    stack = stacks[-2] if len(stacks) > 2 or (len(stacks) == 2 and earlier.rows) else stacks[-1]
    alpha = problem.spec.diagnosis.significance
    power = tuple(
        each
        for kind, size in asked.items()
        for each in power_of(prediction, stack, alpha, kind, size)
    )
    return Expectation(
        tuple(deviations),
        power if asked else sizes_shown(prediction, stack, alpha),
        same or not earlier.rows,
    )
