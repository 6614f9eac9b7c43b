"""Compare the solver with SciPy's SLSQP on the same problem from the same start.

    python -m benchmarks.compare_solvers [problem.yaml ...] --seconds 5 15 30 --seeds 1 2

Every time limit is a run of its own, so a figure is what a user gets who sets `max_seconds` to it;
a run that converged before a limit is not repeated for a longer one. One core is used. Without a
file a small set is taken: UR10 within its joint limits, and TALOS' arms in balance.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.slsqp import ScipySlsqp
from excite_cli.config.constraints_spec import ConstraintsSpec, DiscSpec, JointLimitsSpec
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import FourierSpec
from excite_cli.errors import ExciteError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.progress import Progress
from excite_cli.excitation.solvers.base import Effort, Solver
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.start import clear_posture, random_start
from excite_cli.excitation.task import MotionTask

SOLVERS: dict[str, Callable[[], Solver]] = {
    "interior_point": InteriorPoint,
    "slsqp": ScipySlsqp,
}


@dataclass(frozen=True)
class Run:
    """One solver, seed and time limit; `margin` is the smallest residual of the outcome."""

    condition_number: float
    seconds: float
    iterations: int
    evaluations: int
    status: str
    margin: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("configs", nargs="*", type=Path, help="problems; default: a small set")
    parser.add_argument("--seconds", nargs="+", type=float, default=[5.0, 15.0, 30.0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--solvers", nargs="+", choices=SOLVERS, default=list(SOLVERS))
    parser.add_argument("--max-iterations", type=int, default=100_000)
    parser.add_argument("--tolerance", type=float, default=1e-3)
    arguments = parser.parse_args()
    limits = sorted(arguments.seconds)
    with threadpool_limits(1):
        for name, problem in problems(arguments.configs):
            names = [constraint.name for constraint in problem.constraints]
            print(f"\n{name}: {problem.variables} variables, {', '.join(names)}")
            print(header(limits), flush=True)
            for seed in arguments.seeds:
                for solver in arguments.solvers:
                    runs = compare(problem, solver, seed, limits, arguments)
                    print(row(solver, seed, runs), flush=True)


def problems(configs: list[Path]) -> list[tuple[str, Problem]]:
    """The problems of the files, or the small set."""
    if not configs:
        return [(name, build_problem(spec)) for name, spec in small_set().items()]
    from excite_cli.config.load import load_spec

    return [(path.stem, build_problem(load_spec(path), path.parent)) for path in configs]


def small_set() -> dict[str, Spec]:
    """Problems that need no file."""
    half_sitting = {
        f"{limb}_{side}_{joint}_joint": sign * value
        for side, sign in (("left", 1.0), ("right", -1.0))
        for limb, joint, value in (("arm", 1, 0.25847), ("arm", 2, 0.4))
    }
    for side in ("left", "right"):
        half_sitting |= {
            f"arm_{side}_4_joint": -0.525366,
            f"arm_{side}_7_joint": 0.1,
            f"leg_{side}_3_joint": -0.411354,
            f"leg_{side}_4_joint": 0.859395,
            f"leg_{side}_5_joint": -0.448041,
        }
    arms = tuple(f"arm_{side}_{i}_joint" for side in ("left", "right") for i in range(1, 8))
    return {
        "ur10": Spec(
            robot=RobotSpec(urdf="example-robot-data:ur10"),
            constraints=ConstraintsSpec(joint_limits=JointLimitsSpec(acceleration=10.0)),
        ),
        "talos_arms": Spec(
            robot=RobotSpec(urdf="example-robot-data:talos", joints=arms, posture=half_sitting),
            trajectory=FourierSpec(harmonics=10),
            constraints=ConstraintsSpec(
                joint_limits=JointLimitsSpec(acceleration=10.0), balance=DiscSpec(radius=0.01)
            ),
        ),
    }


def compare(
    problem: Problem, solver: str, seed: int, limits: list[float], effort: argparse.Namespace
) -> list[Run | ExciteError]:
    """Runs of one solver for rising time limits; its error where it cannot run."""
    runs: list[Run | ExciteError] = []
    for limit in limits:
        last = runs[-1] if runs else None
        if isinstance(last, ExciteError) or (last and last.status != "time limit"):
            runs.append(last)
            continue
        try:
            allowed = Effort(effort.max_iterations, limit, effort.tolerance)
            runs.append(measured(problem, SOLVERS[solver](), seed, allowed))
        except ExciteError as error:
            runs.append(error)
    return runs


def measured(problem: Problem, solver: Solver, seed: int, effort: Effort) -> Run:
    """One run from the start that `seed` draws."""
    task = MotionTask(problem)
    x0 = random_start(task, clear_posture(task, seed), (seed, 1, 0))
    task.evaluations = 0

    def silent(progress: Progress) -> None:
        """Comparisons show no progress."""

    began = time.perf_counter()
    outcome = solver.solve(task, x0, effort, silent)
    seconds = time.perf_counter() - began
    values = task.values(task.states(outcome.x))
    return Run(
        task.objective.own_condition_number(task.coefficients(outcome.x)),
        seconds,
        outcome.iterations,
        outcome.evaluations,
        outcome.status,
        min((float(value.min()) for value in values), default=float("inf")),
    )


def header(limits: list[float]) -> str:
    marks = "".join(f"{f'≤{limit:g} s':>9}" for limit in limits)
    return (
        f"{'solver':<16}{'seed':>5}{marks}{'seconds':>9}{'iter.':>7}{'evals':>7}"
        f"{'margin':>10}  status"
    )


def row(solver: str, seed: int, runs: list[Run | ExciteError]) -> str:
    """Condition numbers at every limit, and how the longest run ended."""
    start, last = f"{solver:<16}{seed:>5}", runs[-1]
    if isinstance(last, ExciteError):
        return f"{start}  {last}"
    marks = "".join(f"{run.condition_number:9.3f}" for run in runs if isinstance(run, Run))
    return (
        f"{start}{marks}{last.seconds:9.1f}{last.iterations:7d}{last.evaluations:7d}"
        f"{last.margin:10.1e}  {last.status}"
    )


if __name__ == "__main__":
    main()
