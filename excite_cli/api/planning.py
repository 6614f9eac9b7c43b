"""Motions one after the other, each with all earlier data stacked: `excite optimize`."""

from collections.abc import Callable, Sequence
from pathlib import Path

from excite_cli.api.loading import Case
from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.diagnosis.next_motion import NextMotion
from excite_cli.diagnosis.next_motion import plan_after as after_diagnosis
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import FileError
from excite_cli.excitation.motion import Progress
from excite_cli.excitation.planned_prior import planned_stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.sequence import Step
from excite_cli.excitation.stack import Stack
from excite_cli.measurement.dataset import Dataset
from excite_cli.store.fit_knowledge import fit_knowledge
from excite_cli.store.result_file import read_result, write_result
from excite_cli.store.versions import versions
from excite_cli.trajectory.chain import Segment
from excite_cli.workers.base import Workers

PlanProgress = Callable[[int, Progress], None]
Prior = str | Path | Result | Dataset | Segment | Stack


def plan(
    problem: Problem | NextMotion,
    *,
    priors: Sequence[Prior] = (),
    starts: Sequence[Segment] = (),
    output: str | Path | None = None,
    overwrite: bool = False,
    progress: PlanProgress = lambda motion, progress: None,
    workers: Workers | None = None,
) -> Result:
    """Motions one after the other, each with all earlier data stacked: `excite optimize`.

    Their number is `sequence.motions` of the config. With a `NextMotion` (see `plan_after`) the
    measured data of the diagnosis come first. `priors` are earlier results (or their files),
    measured data, or motions; the search of motion k starts from the k-th of `starts`. With
    `output` the result is on disk after every motion. `progress(k, state)` is called by the solver.
    `workers` (`open_workers`) share the starts of a motion, with the same result.

    Returns
    -------
    Result
        Its `motions` have `coefficients` (K, n), `condition_number`, `stacked_condition_number`,
        `margins` and what is `certified`.

    Raises
    ------
    NoAdmissibleMotionError
        There is none, or none was found; the message names what stands in the way.
    FileError
        A prior does not fit, or `output` exists.

    Examples
    --------
    >>> problem = load_problem("configs/smoke.yaml", ["optimizer.max_iterations=20"])
    >>> [motion.status for motion in plan(problem).motions]
    ['iteration limit', 'iteration limit']
    """
    path = Path(output) if output is not None else None
    if path is not None and path.exists() and not overwrite:
        raise FileError(f"{path} exists already. Give another name, or overwrite=True.")
    following = problem if isinstance(problem, NextMotion) else None
    model = following.model if following else problem
    assert isinstance(model, Problem)
    stacks: list[tuple[str, Result | Stack]] = []
    if following is not None:
        stacks.append(("the diagnosis", following.prior))
    stacks += [_stack_of(model, prior, k) for k, prior in enumerate(priors, start=1)]

    def store(step: Step, current: Result) -> None:
        if path is not None:
            write_result(path, current, model)

    return continue_run(
        following.problem if following else model,
        new_result(model, stacks, versions(), model.folder),
        lambda index: lambda state: progress(index, state),
        store,
        following.model if following else None,
        starts,
        workers,
    )


def _stack_of(problem: Problem, prior: Prior, number: int) -> tuple[str, Result | Stack]:
    if isinstance(prior, str | Path):
        return str(prior), read_result(Path(prior))
    name = f"prior {number}"
    if isinstance(prior, Dataset):
        return name, measured_stack(problem, prior)[0]
    if isinstance(prior, Segment):
        return name, planned_stack(problem, prior)[0]
    return name, prior


def plan_after(problem: Problem | Case, found: Diagnosis) -> NextMotion:
    """The problem of the next motion after a diagnosis, for `plan`: `excite optimize --after`.

    It separates effects that could not be told apart; if there are none, it excites the model with
    all effects found. `messages` of what is returned say which, and why.

    Raises
    ------
    FileError
        The diagnosis belongs to another robot.
    """
    spec, folder = problem.spec, problem.folder
    return after_diagnosis(found, spec, folder, fit_knowledge(spec, folder))
