"""Judging motions before a robot plays them: `excite check`."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.motions import Motions, load_motions
from excite_cli.api.planning import duration_is_free
from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import FileError
from excite_cli.excitation.admissible import path_of
from excite_cli.excitation.entry import PaceLimits, slowing
from excite_cli.excitation.inspection import (
    Inspections,
    Look,
    SampleDifference,
    inspect,
    largest_mismatch,
    mesh_check_of,
)
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.robot.model import Array
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.store.result_file import is_result, read_result, read_samples
from excite_cli.summary.motion_inspections import check_answer as check_answer
from excite_cli.trajectory.fade import Segment

_JUDGED = ("robot", "constraints", "uncertainty")  # sections that verdicts speak of


@checked("motions")
def check(
    problem: Problem,
    motions: Motions,
    *,
    rate: float = 1000.0,
    random: int = 0,
    meshes: bool = True,
    slow: float | None = None,
    progress: Callable[[int, int], None] = unheard,
    tell: Tell = log_note,
) -> Inspections:
    """Every motion against every constraint, proved where it can be: `excite check`.

    `motions` are a result, what `motions_of` gives, or any file of motions. Margins are taken at
    `rate` [Hz] and at `random` further instants; verdicts hold between them. With `slow` the
    motions are judged slowed to that share of the limits of speed, acceleration and jerk.
    `progress(done, total)` is called before every motion.

    Returns
    -------
    Inspections
        A mapping by the motion's name; `states` of each give (`proved` | `sampled` | `broken`,
        reason) by constraint, `margins` the worst margin with unit, place and time, `violations`
        their number.

    Raises
    ------
    FileError
        The file cannot be read; the motions are of another robot or another trajectory.
    """
    segments = load_motions(problem, motions, tell=tell)
    names = [each.name for each in segments]
    if not names:
        raise FileError("There is no motion to check.")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise FileError(f"Two motions are called {twice}. Give each a name of its own.")
    result = _result_of(motions)
    if result is not None:
        name = str(motions) if isinstance(motions, str | Path) else "the result"
        _compare_configs(problem, result, name, tell)
    checker = mesh_check_of(problem) if meshes else None
    look = Look(rate, random, problem.spec.seed)
    stored = _samples(motions) if slow is None else {}
    found, differences = {}, {}
    for index, segment in enumerate(segments, start=1):
        progress(index - 1, len(segments))
        played = _slowed(problem, segment, slow, tell)
        path = path_of(problem, played.trajectory, played.coefficients)
        found[segment.name] = inspect(problem, path, checker, look)
        if index in stored:
            t, *states = stored[index]
            differences[segment.name] = SampleDifference(*largest_mismatch(path, t, states))
    doubted = () if result is None else result.doubted()
    doubts = {f"motion_{each.index}": each.doubt for each in doubted}
    return Inspections(found, look, differences, slow, doubts)


def _result_of(motions: Motions) -> Result | None:
    """The result that the motions are of, if they are of one."""
    if isinstance(motions, str | Path):
        return read_result(Path(motions)) if is_result(Path(motions)) else None
    return motions if isinstance(motions, Result) else None


def _compare_configs(problem: Problem, result: Result, name: str, tell: Tell) -> None:
    """A result must have been made with the trajectory section of the config.

    What else differs of what verdicts speak of is reported: they are those of the config.

    Raises
    ------
    FileError
        It has another trajectory section, where its motions may not be shorter than that says.
    """
    stored = parse_spec(result.config, f"the config stored in {name}")
    if stored.trajectory != problem.spec.trajectory and not duration_is_free(stored):
        raise FileError(f"{name} has motions of another trajectory section than the config.")
    differing = [key for key in _JUDGED if getattr(stored, key) != getattr(problem.spec, key)]
    if result.fingerprint != problem.robot.fingerprint():
        differing.append("the robot's file or posture")
    if differing:
        text = (
            f"{name} was planned with another config (different: {', '.join(differing)}); it is "
            "judged by the one given here"
        )
        tell(Note(Level.INFO, text))


def _slowed(problem: Problem, segment: Segment, share: float | None, tell: Tell) -> Segment:
    if share is None:
        return segment
    limits = PaceLimits.of(problem.constraints, problem.robot.n)
    pace = slowing(limits, segment.trajectory, segment.coefficients, share)
    tell(Note(Level.INFO, f"{segment.name}: slowed to {100 * pace:.4g}% of its planned speed"))
    return replace(segment, trajectory=segment.trajectory.slowed(pace))


def _samples(motions: Motions) -> dict[int, tuple[Array, ...]]:
    """The samples t (T,), q, v, a (T, n) of a result file, by the motion's index."""
    if isinstance(motions, str | Path) and is_result(Path(motions)):
        return dict(read_samples(Path(motions)))
    return {}
