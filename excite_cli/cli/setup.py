"""From command-line arguments to a problem, with what is worth saying about it."""

from collections import Counter
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from excite_cli.cli.console import Terminal
from excite_cli.config.load import load_spec
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.effects.catalogue import declared_effects
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.robot.collision_pairs import UNGUARDED, CollisionPairs

if TYPE_CHECKING:
    from excite_cli.config.spec import Spec
    from excite_cli.diagnosis.next_motion import NextMotion
    from excite_cli.excitation.result import Result
    from excite_cli.excitation.stack import Stack
    from excite_cli.measurement.dataset import Dataset
    from excite_cli.robot.model import Robot


def single_threaded(threads: int = 1) -> AbstractContextManager[object]:
    """Limit the linear algebra library: its matrices here are too small for many threads."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=threads)


def load_problem(
    terminal: Terminal, config: Path, overrides: list[str] | None, extra: list[str] | None = None
) -> Problem:
    """Load, override, build; tell what was understood."""
    spec = load_spec(config, [*(overrides or []), *(extra or [])])
    problem = build_problem(spec, config.resolve().parent)
    tell_problem(terminal, problem)
    return problem


def load_next_motion(
    terminal: Terminal, config: Path, after: Path, changes: list[str]
) -> "NextMotion":
    """The problem of `config` after the diagnosis `after`; tell what is planned and why."""
    from excite_cli.diagnosis.next_motion import plan_after
    from excite_cli.store.diagnosis_file import read_diagnosis

    found = plan_after(read_diagnosis(after), load_spec(config, changes), config.resolve().parent)
    tell_problem(terminal, found.model)
    for message in found.messages:
        terminal.say(message)
    return found


def load_priors(
    terminal: Terminal, problem: Problem, files: Sequence[Path]
) -> list[tuple[str, "Result | Stack"]]:
    """Earlier results, and stacks of measured data; the format is told by the file itself.

    Raises
    ------
    FileError
        A file cannot be read, or is a diagnosis.
    """
    from excite_cli.diagnosis.measured_prior import measured_stack
    from excite_cli.store.diagnosis_file import is_diagnosis
    from excite_cli.store.result_file import is_result, read_result

    found: list[tuple[str, Result | Stack]] = []
    for path in files:
        if is_diagnosis(path):
            raise FileError(f"--prior {path} is a diagnosis. Plan on top of it with --after.")
        if not path.exists() or is_result(path):
            found.append((str(path), read_result(path)))
            continue
        data = load_dataset(terminal, problem.robot, problem.spec, [path])
        stack, words = measured_stack(problem, data)
        terminal.say(f"--prior {path}: {words}")
        found.append((str(path), stack))
    return found


def load_dataset(
    terminal: Terminal, robot: "Robot", spec: "Spec", files: Sequence[Path]
) -> "Dataset":
    """Measured data of `robot`, checked; what was noticed is told.

    Raises
    ------
    FileError
        A file cannot be read, or holds what no diagnosis should be made of.
    """
    from excite_cli.measurement.catalogue import read_dataset
    from excite_cli.measurement.quality import raise_for_errors

    limits = robot.limits
    data = read_dataset(
        files,
        spec.measurement,
        robot.joint_names,
        (limits.lower, limits.upper, limits.velocity, limits.effort),
        (~robot.sliding).astype(float),
    )
    raise_for_errors(data)
    terminal.say(
        f"{robot.name}: {robot.n} joints; {len(data.runs)} runs, "
        f"{sum(run.duration for run in data.runs):.3g} s"
    )
    for finding in data.findings:
        where = f" ({finding.run})" if finding.run else ""
        terminal.say(f"{finding.severity}{where}: {finding.text}")
    return data


def tell_problem(terminal: Terminal, problem: Problem) -> None:
    """Say what was understood."""
    robot = problem.robot
    terminal.say(
        f"{robot.name}: {robot.n} joints, {problem.base.rank} base parameters, "
        f"{problem.variables} variables, {len(problem.cost_basis.times)} cost and "
        f"{len(problem.constraint_basis.times)} constraint samples"
    )
    criterion, weighting = problem.spec.criterion, problem.weighting
    terminal.say(
        f"criterion: {criterion.kind}, row weights: {weighting.row_name}, column scaling: "
        f"{weighting.column_name}"
    )
    _tell_effects(terminal, problem)
    names = ", ".join(constraint.name for constraint in problem.constraints) or "none"
    terminal.say(f"constraints: {names}")
    for constraint in problem.constraints:
        if isinstance(constraint, SelfCollision):
            pairs = constraint.pairs
            terminal.say(
                f"self-collision: {len(constraint.capsules)} capsules, {len(pairs.checked)} pairs "
                f"checked; not checked (--verbose lists all): {_reasons(pairs)}"
            )
            unguarded = [pair for pair in pairs.dropped if pair.reason.startswith(UNGUARDED)]
            if unguarded:
                loose = sorted({pair.reason.partition("apart: ")[2][:-1] for pair in unguarded})
                terminal.say(
                    "warning: not guarded, since their capsules overlap whatever the posture "
                    "(links and the share of postures in which their meshes are apart): "
                    f"{'; '.join(loose)}. Look at these, or give slimmer capsules under "
                    "constraints.self_collision.capsules."
                )
            for label in constraint.labels:
                terminal.detail(f"  checked  {label}")
            for pair in pairs.dropped:
                terminal.detail(f"  dropped  {pair.first} – {pair.second}: {pair.reason}")
    for name, words in zip(_symbols(problem), problem.base.in_words(), strict=True):
        terminal.detail(f"  base parameter {name}: {words}")


def _tell_effects(terminal: Terminal, problem: Problem) -> None:
    extension, spec = problem.extension, problem.spec
    if extension.names:
        counts = Counter(effect.kind for effect in extension.effects)
        listed = ", ".join(f"{kind} ({count})" for kind, count in counts.items())
        terminal.say(
            f"effects in the regressor: {listed}; {len(extension.names)} columns, each scaled to "
            "the size of the median inertial column"
        )
    for reason in extension.left_out:
        terminal.say(f"left out of the regressor: {reason}")
    if extension.fine:
        terminal.say("the cost is taken on the constraint grid: an effect needs time derivatives")
    if spec.effects is None and declared_effects(None, problem.robot):
        terminal.say(
            "the friction of the URDF's <dynamics> is not in the regressor; list it under effects "
            "to plan for it"
        )
    for name in extension.names:
        terminal.detail(f"  effect column {name}")


def _reasons(pairs: CollisionPairs) -> str:
    """How many pairs were dropped for each reason, figures in the reasons left aside."""
    counts = Counter(pair.reason.split(" (")[0] for pair in pairs.dropped)
    return ", ".join(f"{count} {reason}" for reason, count in counts.most_common()) or "none"


def _symbols(problem: Problem) -> list[str]:
    return [problem.base.names[index] for index in problem.base.selection]


def output_path(output: Path | None, config: Path, overwrite: bool, resume: bool = False) -> Path:
    """Where the result goes.

    Raises
    ------
    FileError
        It exists already and nothing says to replace or resume it.
    """
    path = output or Path(f"{config.stem}.h5")
    if path.is_dir():
        raise FileError(f"{path} is a folder. Give a file name with -o.")
    if path.exists() and not overwrite and not resume:
        raise FileError(
            f"{path} exists already. Give another name with -o, go on with --resume, or replace "
            "it with --overwrite."
        )
    return path
