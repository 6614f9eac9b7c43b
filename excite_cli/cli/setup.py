"""From command-line arguments to a problem, with what is worth saying about it."""

from collections import Counter
from contextlib import AbstractContextManager
from pathlib import Path

from excite_cli.cli.console import Terminal
from excite_cli.config.load import load_spec
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.robot.collision_pairs import UNGUARDED, CollisionPairs


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
    return problem


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
