"""Motions as short as what `sequence.until` asks for allows: their duration is a variable, too.

Information grows with seconds, hardly with how they are divided (`diagnosis/goals.py`). So one
motion of the duration T that the config has says how many seconds it takes, t = T · needed, and
n = ⌈t / T⌉ motions of t / n [s] are planned. Where these show less than is asked for, or more, the
same is done with what they show.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from excite_cli.api.loading import with_spec
from excite_cli.api.motions import load_motions
from excite_cli.config.load_spec import parse_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import FourierSpec, GridSpec, SamplingSpec
from excite_cli.diagnosis.goals import Goal, Goals
from excite_cli.excitation.ending import most_motions
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.trajectory.catalogue import build_trajectory
from excite_cli.trajectory.fade import Segment

# Motions of at least this share of the config's duration: joints need time to use their range.
_SHORTEST = 0.2
_FEWEST_HARMONICS, _FEWEST_POINTS = 5, 15
_ROOM = 1.02  # seconds planned for, of those that are expected to do
_CLOSE = 0.9  # information needed, of what motions have that are short enough
_TRIES = 3
_STEP, _DIGITS = 0.01, 2  # [s] of a duration
_SAME = 1e-3  # of a duration


class Run(Protocol):
    """Plans motions."""

    def __call__(
        self,
        at: Problem,
        begun: Result,
        most: int | None = None,
        begin: Sequence[Segment] = (),
        stored: bool = True,
    ) -> Result:
        """Motions on top of `begun`, so many or until the goals are reached; starts: `begin`."""


def duration_is_free(spec: Spec) -> bool:
    """Whether motions may be shorter than the config's: seconds count, and no number is given."""
    sequence, until = spec.sequence, spec.sequence.until
    return sequence.motions is None and until is not None and until.counts_seconds


def as_planned(problem: Problem, result: Result) -> Problem:
    """The problem, of motions as short as those of `result`, where their duration is free."""
    if not result.motions or not duration_is_free(problem.spec):
        return problem
    stored = parse_spec(result.config, "the config stored in the result")
    return of_duration(problem, build_trajectory(stored.trajectory).duration)


def of_duration(problem: Problem, duration: float) -> Problem:
    """The problem of motions of `duration` [s], no faster in their shape: with fewer coefficients.

    The cost has as many samples as before, the constraints have them as densely.
    """
    spec, before = problem.spec, problem.trajectory.duration
    if abs(duration - before) < _SAME * before:
        return problem
    trajectory, duration = spec.trajectory, round(duration, _DIGITS)
    if isinstance(trajectory, FourierSpec):
        count = _fewer(trajectory.harmonics, duration / before, _FEWEST_HARMONICS)
        shape: dict[str, Any] = {"base_frequency": 2.0 * math.pi / duration, "harmonics": count}
    else:
        count = _fewer(trajectory.control_points, duration / before, _FEWEST_POINTS)
        shape = {"duration": duration, "control_points": count}
    sampling = SamplingSpec(
        cost=GridSpec(samples=spec.sampling.cost.samples),
        constraints=GridSpec(step=spec.sampling.constraints.step),
    )
    new = {"trajectory": trajectory.model_copy(update=shape), "sampling": sampling}
    return with_spec(problem, spec.model_copy(update=new))


def _fewer(count: int | None, share: float, fewest: int) -> int:
    assert count is not None  # of a problem
    return min(count, max(fewest, int(count * share)))


@dataclass(frozen=True)
class Found:
    """Motions of a problem, and whether they are the ones that were stored last."""

    problem: Problem
    result: Result
    stored: bool = True


def in_least_time(problem: Problem, begun: Result, run: Run, tell: Tell) -> Found:
    """Motions that reach what is asked for in the fewest seconds that are found, if any do.

    `begun`: without motions, or with the first one of the problem's own duration.
    """
    longest = problem.trajectory.duration
    last, best = Found(problem, run(problem, begun, most=1)), None
    for tries in range(_TRIES + 1):
        at, result = last.problem, last.result
        goals = Goals(at).of(result)
        needed = max(goal.needed for goal in goals)
        if needed <= 1.0 and (best is None or _seconds(last) < _seconds(best)):
            best = last
        count, duration = _wanted(at, goals, len(result.motions), longest)
        better = best is None or count * duration < _seconds(best)
        if tries == _TRIES or count == 0 or not better or (best is last and needed > _CLOSE):
            break
        words = f"{count} motion{'s' * (count > 1)} of {duration:.4g} s"
        tell(Note(Level.INFO, f"sequence.until: {words} should be enough"))
        new, stored = of_duration(problem, duration), best is None
        starts = load_motions(at, result) if len(result.motions) == count else ()
        same = new is at and len(result.motions) < count
        found = run(new, result if same else _without_motions(begun, new), count, starts, stored)
        last = Found(new, found, stored)
    return best or Found(last.problem, run(last.problem, last.result))


def _seconds(found: Found) -> float:
    return len(found.result.motions) * found.problem.trajectory.duration


def _without_motions(begun: Result, problem: Problem) -> Result:
    """What `begun` is before its motions, for those of another duration."""
    return replace(
        begun,
        config=spec_as_yaml(problem.spec),
        row_weights=problem.weighting.rows,
        column_scales=problem.column_scales,
        motions=(),
        stack=begun.prior_stack,
    )


def _wanted(at: Problem, goals: Sequence[Goal], motions: int, longest: float) -> tuple[int, float]:
    """How many motions of how many seconds reach the `goals` that so many `motions` have.

    As few motions as can; none, where no number of them does, or not in the time of all.
    """
    own, until = at.trajectory.duration, at.spec.sequence.until
    allowed = math.inf if until is None or until.duration is None else until.duration
    for count in range(1, most_motions(at.spec.sequence) + 1):
        needed = max(goal.needed * goal.fitted(motions) / goal.fitted(count) for goal in goals)
        duration = max(_ROOM * own * needed, _SHORTEST * longest)
        if duration <= longest:
            duration = min(math.ceil(duration / _STEP) * _STEP, longest)
            return (count, duration) if count * duration <= allowed else (0, 0.0)
    return 0, 0.0
