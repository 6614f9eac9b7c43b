"""Motions one after the other, each with all earlier data stacked: `excite optimize`."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case, inputs_of, load_data, states_of_work, with_spec
from excite_cli.api.motions import Motions, is_motion, load_motions, tell_doubts
from excite_cli.api.outputs import held_result
from excite_cli.api.working import tell_idle
from excite_cli.config.load_spec import parse_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import FourierSpec, GridSpec, SamplingSpec
from excite_cli.diagnosis.goals import Goal, Goals
from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.diagnosis.next_motion import NextMotion
from excite_cli.diagnosis.next_motion import plan_after as after_diagnosis
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import no_gain_in_words
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.motion import Doubt
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem, predicting
from excite_cli.excitation.progress import Progress as Progress
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result, planned_stack, resumed_result
from excite_cli.excitation.sequence import FinishedMotion
from excite_cli.excitation.sequence import most_motions as most_motions
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.answer import Answer
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.store.diagnosis_file import is_diagnosis, read_diagnosis
from excite_cli.store.fit_file import fit_knowledge
from excite_cli.store.own_file import versions
from excite_cli.store.result_file import is_result, read_result, write_result
from excite_cli.summary.motions import motion_sentence
from excite_cli.summary.motions import plan_answer as answer_of_plan
from excite_cli.summary.pairs import doubts_in_words
from excite_cli.summary.problem_notes import problem_notes
from excite_cli.trajectory.catalogue import build_trajectory
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Workers

# Earlier data that a plan goes on from: results, measured data, motions.

Prior = str | Path | Result | Dataset | Segment | Stack


def name_of(prior: Prior, number: int) -> str:
    """What messages and results call the prior: its path, or its number."""
    return str(prior) if isinstance(prior, str | Path) else f"prior {number}"


def load_prior(problem: Problem, prior: Prior, name: str, tell: Tell) -> Result | Stack:
    """What is stacked of a prior; a file itself tells what it holds.

    Raises
    ------
    FileError
        A file cannot be read, or the prior does not fit the problem.
    """
    if isinstance(prior, str | Path):
        path = Path(prior)
        if is_diagnosis(path):
            raise FileError(f"--prior {path} is a diagnosis. Plan on top of it with --after.")
        if not path.exists() or is_result(path):
            prior = read_result(path)
            _tell_changed(prior, name, tell)
            return prior
        if is_motion(path, problem.spec):
            prior = load_motions(problem, path, tell=tell)[0]
        else:
            prior = load_data(problem, path, tell)
    if isinstance(prior, Result):
        _tell_changed(prior, name, tell)
        return prior
    if isinstance(prior, Stack):
        return _fitting(problem, prior, name)
    if isinstance(prior, Segment):
        stack, words = planned_stack(problem, load_motions(problem, prior)[0])
    else:
        prior = load_data(problem, prior, tell) if prior.as_given else prior
        stack, words = measured_stack(problem, prior)
    tell(Note(Level.INFO, f"--prior {name}: {words}"))
    return stack


def _tell_changed(prior: Result, name: str, tell: Tell) -> None:
    """Say that motions are not those that the data which are stacked came of."""
    changed = [each for each in prior.doubted() if each.doubt is Doubt.CHANGED]
    for words in doubts_in_words(changed):
        text = f"--prior {name}: {words}; what is stacked is what the file holds of it from before"
        tell(Note(Level.WARNING, text))


def _fitting(problem: Problem, stack: Stack, name: str) -> Stack:
    columns = stack.factor.shape[1]
    if columns != problem.columns:
        raise FileError(
            f"--prior {name} cannot be stacked: it has {columns} columns, the regressor of this "
            f"problem {problem.columns}. A prior must come from the same robot section, effects "
            "and weighting."
        )
    return stack


Planned = Problem | NextMotion
PlanProgress = Callable[[int, Progress], None]


@dataclass(frozen=True)
class Planner:
    """Plans motions of a problem, or the next one after a diagnosis (`following`).

    The others are as those of `plan`; the result is stored at `path`.
    """

    following: NextMotion | None
    path: Path | None
    starts: Motions
    progress: PlanProgress
    workers: Workers | None
    tell: Tell

    def motions(
        self,
        at: Problem,
        begun: Result,
        most: int | None = None,
        begin: Sequence[Segment] = (),
        stored: bool = True,
    ) -> Result:
        """Motions on top of `begun`, so many or until the goals are reached; starts: `begin`."""
        following = self.following
        goals = Goals(at, following.known if following else None)

        def keep(step: FinishedMotion, current: Result) -> None:
            if self.path is not None and stored:
                write_result(self.path, current, at)
            self.tell(Note(Level.INFO, motion_sentence(step.motion)))

        return continue_run(
            following.problem if following else at,
            begun,
            lambda index: lambda state: self.progress(index, state),
            keep,
            at if following else None,
            begin or load_motions(at, self.starts, tell=self.tell),
            self.workers,
            lambda found: len(found.motions) == most or goals.reached(found),
        )


@checked("starts")
def plan(
    problem: Planned,
    *,
    priors: Sequence[Prior] = (),
    starts: Motions = (),
    output: str | Path | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: PlanProgress = unheard,
    workers: Workers | None = None,
    tell: Tell = log_note,
) -> Result:
    """Motions one after the other, each with all earlier data stacked: `excite optimize`.

    Their number is `sequence.motions` of the config. With a `NextMotion` (see `plan_after`) the
    measured data of the diagnosis come first. `priors` are earlier results (or their files),
    measured data, or motions; the search of motion k starts from the k-th of `starts`. With
    `output` the result is on disk after every motion, and `resume` goes on with it.
    `progress(k, state)` is called by the solver. `workers` (`open_workers`) share the starts of a
    motion, with the same result.

    Returns
    -------
    Result
        Its `motions` have `coefficients` (K, n), `condition_number`, `stacked_condition_number`,
        `margins` and what is `certified`.

    Raises
    ------
    NoAdmissibleMotionError
        There is none, or none was found; the message names the constraint that prevents it.
    FileError
        A prior or a start does not fit, or `output` exists.

    Examples
    --------
    >>> from excite_cli import load_problem, plan
    >>> problem = load_problem("configs/smoke.yaml", ["optimizer.max_iterations=20"])
    >>> [motion.status for motion in plan(problem).motions]
    ['iteration limit', 'iteration limit']
    """
    path = None if output is None else Path(output)
    following = problem if isinstance(problem, NextMotion) else None
    model = problem.model if isinstance(problem, NextMotion) else problem

    planner = Planner(following, path, starts, progress, workers, tell)
    read = inputs_of(model, priors, starts, following.name if following else None)
    with held_result(path, overwrite, resume, read):
        tell_idle(1 if workers is None else workers.count, model.restarts, tell)
        at, result = _begun(model, following, priors, path if resume else None, tell)
        fixed = following is not None or not duration_is_free(model.spec)
        if fixed or at is not model or result.priors or len(result.motions) > 1:
            return planner.motions(at, result)
        found = in_least_time(planner, model, result)
        if path is not None and not found.stored:
            write_result(path, found.result, found.problem)
        return found.result


def _begun(
    model: Problem,
    following: NextMotion | None,
    priors: Sequence[Prior],
    stored: Path | None,
    tell: Tell,
) -> tuple[Problem, Result]:
    """The result to go on with: that of the file `stored` if there is one, else what is earlier.

    And the problem that it is of: as `model`, or with the duration that motions of the file have.
    """
    names = [name_of(prior, number) for number, prior in enumerate(priors, start=1)]
    earlier = [following.name, *names] if following else names
    if stored is not None and stored.exists():
        read = read_result(stored)
        model = as_planned(model, read)
        found = resumed_result(model, read, stored, [Path(n) for n in earlier])
        count, held = len(found.motions), len(read.motions)
        anew = f"; motion {held}, which was interrupted, is made anew" if held > count else ""
        tell(Note(Level.INFO, f"resuming after motion {count} of {stored}{anew}"))
        tell_doubts(found, str(stored), tell)
        return model, found
    stacks: list[tuple[str, Result | Stack]] = []
    if following is not None:
        stacks.append((following.name, following.prior))
    for name, prior in zip(names, priors, strict=True):
        stacks.append((name, load_prior(model, prior, name, tell)))
    return model, new_result(model, stacks, versions(), model.folder)


def plan_answer(
    planned: Planned,
    result: Result,
    output: str,
    efficiency: bool = False,
    power: Mapping[str, float] | None = None,
) -> Answer:
    """What `excite optimize` answers; see `summary.motions.plan_answer`."""
    if isinstance(planned, Problem):
        planned = as_planned(planned, result)
    return answer_of_plan(planned, result, output, efficiency, power)


@checked()
def plan_after(
    problem: Problem | Case, found: Diagnosis | str | Path, tell: Tell = log_note
) -> NextMotion:
    """The problem of the next motion after a diagnosis, for `plan`: `excite optimize --after`.

    `found` is the diagnosis, or its file. The next motion separates effects that could not be told
    apart; if there are none, it excites the model with all effects found. `messages` of what is
    returned say which, and why.

    Raises
    ------
    FileError
        The file cannot be read; the diagnosis belongs to another robot.
    ConfigError
        The criterion is that of a load: such a config was written by `--for payload`.
    """
    spec, folder = problem.spec, problem.folder
    if spec.criterion.of == "load":
        raise ConfigError(
            f"{problem.file or 'This config'}: criterion.of: load is for the motion of --for "
            "payload. --after plans for the robot: give the config that was diagnosed."
        )
    read = found if isinstance(found, Diagnosis) else read_diagnosis(Path(found))
    work = states_of_work(spec, folder, tell)
    following = after_diagnosis(read, spec, folder, fit_knowledge(spec, folder), work)
    following = replace(following, model=replace(following.model, file=problem.file))
    if not isinstance(found, Diagnosis):
        following = replace(following, name=str(found))
    if not read.good:
        tell(Note(Level.WARNING, no_gain_in_words(read)))
    for note in problem_notes(following.model):
        tell(note)
    for message in following.messages:
        tell(Note(Level.INFO, message))
    return following


def sizes_asked(given: Sequence[str], planned: Planned) -> dict[str, float]:
    """Sizes by kind of `KIND=SIZE` texts, for the power of motions that will be `planned`.

    Raises
    ------
    ConfigError
        A text is not KIND=SIZE, there is no such kind, or no planned motion shows it.
    """
    found = {}
    for text in given:
        kind, _, size = text.partition("=")
        kind_named(kind.strip(), "--power")
        try:
            found[kind.strip()] = abs(float(size))
        except ValueError:
            raise ConfigError(
                f"--power {text}: give the kind of an effect and a size of its first parameter, "
                "such as --power load_dependent_friction=0.03."
            ) from None
    if found:
        predicting(planned.model if isinstance(planned, NextMotion) else planned, tuple(found))
    return found


# Motions as short as what `sequence.until` asks for allows: their duration is a variable, too.
#
# Information grows with seconds, hardly with how they are divided (`diagnosis/goals.py`). So one
# motion of the duration T that the config has says how many seconds it takes, t = T · needed, and
# n = ⌈t / T⌉ motions of t / n [s] are planned. Where these show less than is asked for, or more,
# the same is done with what they show.

# Motions of at least this share of the config's duration: joints need time to use their range.
_SHORTEST = 0.2
_FEWEST_HARMONICS, _FEWEST_POINTS = 5, 15
_ROOM = 1.02  # seconds planned for, of those that are expected to do
_CLOSE = 0.9  # information needed, of what motions have that are short enough
_TRIES = 3
_STEP, _DIGITS = 0.01, 2  # [s] of a duration
_SAME = 1e-3  # of a duration


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


def in_least_time(planner: Planner, problem: Problem, begun: Result) -> Found:
    """Motions that reach what is asked for in the fewest seconds that are found, if any do.

    `begun`: without motions, or with the first one of the problem's own duration.
    """
    longest = problem.trajectory.duration
    last, best = Found(problem, planner.motions(problem, begun, most=1)), None
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
        planner.tell(Note(Level.INFO, f"sequence.until: {words} should be enough"))
        new, stored = of_duration(problem, duration), best is None
        starts = load_motions(at, result) if len(result.motions) == count else ()
        same = new is at and len(result.motions) < count
        before = result if same else _without_motions(begun, new)
        last = Found(new, planner.motions(new, before, count, starts, stored), stored)
    return best or Found(last.problem, planner.motions(last.problem, last.result))


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
