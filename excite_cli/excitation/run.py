"""A run over a whole problem: fresh, on top of earlier results, or resumed."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from excite_cli.config.load_spec import parse_spec, spec_as_yaml
from excite_cli.config.spec import OptimizerSpec, SequenceSpec, Spec
from excite_cli.errors import FileError
from excite_cli.excitation.motion import Doubt
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import ProgressCallback, Status
from excite_cli.excitation.result import Result, matches
from excite_cli.excitation.sequence import (
    FinishedMotion,
    dense_condition_number,
    generate_sequence,
    motions_within,
)
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.geometry.reasons import dropped_in_words
from excite_cli.trajectory.fade import Segment
from excite_cli.workers.base import Workers


def new_result(
    problem: Problem,
    priors: Sequence[tuple[str, Result | Stack]],
    versions: dict[str, str],
    folder: Path | None = None,
) -> Result:
    """A result without motions, its stack made of the priors; `folder` is that of the config.

    A prior is an earlier result, or the stack of measured data (`measured_stack`).

    Raises
    ------
    FileError
        A prior does not fit the problem.
    """
    seen: set[Path] = set()
    for name, _ in priors:
        if Path(name).resolve() in seen:
            raise FileError(f"--prior {name} is given twice; its data would count twice.")
        seen.add(Path(name).resolve())
    stack = Stack.empty(problem.columns)
    for name, prior in priors:
        if isinstance(prior, Result):
            reason = matches(problem, prior)
            if reason:
                raise FileError(
                    f"--prior {name} cannot be stacked: {reason}. A prior must come from the same "
                    "robot section, effects and weighting."
                )
            prior = prior.stack
        stack = stack.with_stack(prior)
    checked, dropped = _pairs(problem)
    return Result(
        config=spec_as_yaml(problem.spec),
        config_folder=str((folder or Path.cwd()).resolve()),
        fingerprint=problem.robot.fingerprint(),
        seed=problem.spec.seed,
        joint_names=problem.robot.joint_names,
        base_selection=problem.base.selection,
        base_words=problem.column_words,
        row_weights=problem.weighting.rows,
        column_scales=problem.column_scales,
        motions=(),
        stack=stack,
        prior_stack=stack,
        priors=tuple(name for name, _ in priors),
        versions=versions,
        checked_pairs=checked,
        dropped_pairs=dropped,
    )


def resumed_result(
    problem: Problem, result: Result, path: Path, priors: Sequence[Path] = ()
) -> Result:
    """The stored result, once it is sure that it belongs to this problem.

    Raises
    ------
    FileError
        The stored config differs in more than the number of motions and the optimizer, or
        `priors` are not those that the file was made with; a motion was changed since.
    """
    if priors and tuple(str(prior) for prior in priors) != result.priors:
        made = ", ".join(result.priors) or "none"
        raise FileError(
            f"--resume --prior: {path} was made with other priors ({made}). Leave --prior out to "
            "go on with it, or give another -o."
        )
    stored = parse_spec(result.config, f"the config stored in {path}")
    if _asked(stored) != _asked(problem.spec) or matches(problem, result):
        keys = _differing(stored, problem.spec)
        raise FileError(
            f"--resume: {path} was made with another config (different: {', '.join(keys)}). "
            "Resume with the config it was made with, or give another -o."
        )
    changed = [str(each.index) for each in result.doubted() if each.doubt is Doubt.CHANGED]
    if changed:
        raise FileError(
            f"--resume: motion {', '.join(changed)} of {path} is not proved: {Doubt.CHANGED}. More "
            "motions would be planned on top of an unchecked one. Put the file back as it was, "
            "or give another -o; `--start` makes proved motions of those in a file."
        )
    return _finished(problem, result).with_config(spec_as_yaml(problem.spec))


def _finished(problem: Problem, result: Result) -> Result:
    """The result without a last motion that was interrupted: that one is made anew."""
    motions = result.motions
    if not motions or motions[-1].status is not Status.INTERRUPTED:
        return result
    stack, objective = result.prior_stack, problem.objective()
    for motion in motions[:-1]:
        stack = objective.added_to(stack, motion.coefficients)
    return replace(result, motions=motions[:-1], stack=stack)


def continue_run(
    problem: Problem,
    result: Result,
    report: Callable[[int], ProgressCallback],
    on_motion: Callable[[FinishedMotion, Result], None],
    model: Problem | None = None,
    starts: Sequence[Segment] = (),
    workers: Workers | None = None,
    reached: Callable[[Result], bool] = lambda result: False,
) -> Result:
    """Generate the motions that are still missing, calling `on_motion` after each.

    The search of motion k starts from the k-th of `starts`, as far as there are any. With
    `optimizer.restarts` the starts of a motion are spread over `workers` (default: done here), to
    the same result.

    Interrupted, the best of the motion so far is given to `on_motion` before that goes on.

    They end with the motion with which what is asked for is `reached`.

    Where `problem` separates effects, `model` is the problem that the result is kept for: the same
    without the rivals. Stack and condition numbers are then its own.
    """
    solver, seed = InteriorPoint(), problem.spec.seed
    remaining = range(len(result.motions) + 1, motions_within(problem) + 1)
    stack = _running(problem, result)
    if reached(result):
        return result
    for step in generate_sequence(problem, solver, stack, remaining, seed, report, starts, workers):
        stored = step if model is None else _judged(step, model, result.stack)
        result = result.with_step(stored)
        on_motion(stored, result)
        if step.motion.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if reached(result):
            break
    return result


def _running(problem: Problem, result: Result) -> Stack:
    """The stack to go on from: the stored one, or all anew where it lacks the rivals' columns."""
    if problem.separation is None:
        return result.stack
    stack, objective = problem.separation.prior, problem.objective()
    for motion in result.motions:
        stack = objective.added_to(stack, motion.coefficients)
    return stack


def _judged(step: FinishedMotion, model: Problem, stack: Stack) -> FinishedMotion:
    """The step as `model` sees it: its stack and its condition numbers."""
    objective, alpha = model.objective(stack), step.motion.coefficients
    motion = replace(
        step.motion,
        condition_number=objective.own_condition_number(alpha),
        stacked_condition_number=objective.stacked_condition_number(alpha),
        dense_condition_number=dense_condition_number(model, stack, alpha),
    )
    return FinishedMotion(motion, objective.added_to(stack, alpha))


def _asked(spec: Spec) -> Spec:
    """What a stored motion answers: all but the number of motions and the effort spent."""
    return spec.model_copy(update={"sequence": SequenceSpec(), "optimizer": OptimizerSpec()})


def _differing(first: Spec, second: Spec) -> list[str]:
    return [
        name
        for name in type(first).model_fields
        if getattr(first, name) != getattr(second, name) and name not in ("sequence", "optimizer")
    ] or ["the URDF or the library versions"]


def _pairs(problem: Problem) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Pairs that are kept apart, and those that are not with the reasons."""
    checked: list[str] = []
    dropped: list[str] = []
    for constraint in problem.constraints:
        left_out = constraint.left_out
        if left_out is not None:
            checked += constraint.labels
            dropped += map(dropped_in_words, left_out)
    return tuple(checked), tuple(dropped)


def planned_stack(problem: Problem, motion: Segment) -> tuple[Stack, str]:
    """The motion's rows as a stack that fits `problem`, and what was made of it in words.

    It is sampled as sparsely as the cost grid, so that a second of it weighs as much as a second of
    the motions to be planned.
    """
    step = float(np.diff(problem.cost_basis.times[:2])[0])
    duration = motion.trajectory.duration
    count = max(2, round(duration / step))
    times = np.minimum(np.arange(count, dtype=float) * step, duration)
    block = problem.objective().block_of(
        times, *motion.trajectory.states(times, motion.coefficients)
    )
    words = f"{duration:.4g} s of motion, {count} samples every {step:.3g} s (as the cost grid)"
    return Stack.empty(problem.columns).with_rows(block), words
