"""A problem with its prediction, whatever its motions are planned for."""

from collections.abc import Sequence
from dataclasses import replace

from excite_cli.effects.base import Effect
from excite_cli.excitation.prediction import build_prediction
from excite_cli.excitation.problem import Problem, acceleration_bounds, on_fine_grid


def predicting(
    problem: Problem, kinds: Sequence[str] = (), possible: Sequence[Effect] | None = None
) -> Problem:
    """The problem with its prediction, in which these kinds of effects are possible, too.

    Made for another criterion, or without one of them, it gets a prediction beside that, with the
    effects `possible` in place of the usual ones.
    """
    there = {effect.kind for effect in problem.extension.effects}
    if problem.prediction is not None and there.issuperset(kinds):
        return problem
    made = build_prediction(
        problem.spec,
        problem.robot,
        problem.base,
        [] if problem.prediction is not None else problem.extension.effects,
        acceleration_bounds(problem.spec, problem.robot),
        problem.trajectory.duration,
        len(problem.cost_basis.times),
        problem.work,
        kinds,
        possible,
    )
    wide = replace(
        problem,
        weighting=made.weighting,
        extension=made.extension,
        prediction=made,
        separation=None,
        metric=None,
    )
    return on_fine_grid(wide) if made.extension.fine else wide
