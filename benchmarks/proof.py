"""What proof between the instants costs: motions with and without certificates, in one run.

Per config and seed the same problem is solved three times, interleaved: constraints kept on the
instants of the optimiser's grid only, without any guard (`grid`), on 1 kHz samples
(`optimizer.certify` false, `sampled`), and proved (`proved`). Seconds and condition numbers as
ratios, the seconds that a certificate takes, and what it says of the motions that are not proved.

Run: python -m benchmarks.proof [--seeds 1 2 3] [CONFIG …]
"""

import argparse
import time
from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import problem
from excite_cli.constraints.base import Array
from excite_cli.excitation.admissible import verdicts
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.excitation.solvers.base import Effort
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.start import random_start
from excite_cli.excitation.task import MotionTask

CONFIGS = ("talos_arms",)


def solved(name: str, seed: int, certify: bool) -> tuple[Problem, Result, float]:
    """The problem, its motions and the seconds they took."""
    of = problem(name, f"seed={seed}", f"optimizer.certify={str(certify).lower()}",
                 "optimizer.max_seconds=1000")  # fmt: skip
    began = time.perf_counter()
    result = continue_run(
        of,
        new_result(of, [], {}),
        lambda index: lambda progress: None,
        lambda step, current: None,
    )
    return of, result, time.perf_counter() - began


def on_the_grid(name: str, seed: int) -> tuple[Problem, list[Array], list[float], float]:
    """Motions that nothing is asked of between the instants of the grid."""
    of = problem(name, f"seed={seed}", "optimizer.max_seconds=1000")
    spec = of.spec.optimizer
    solver, stack = InteriorPoint(), Stack.empty(of.columns)
    effort = Effort(spec.max_iterations, spec.max_seconds, spec.tolerance)
    found, numbers = [], []
    began = time.perf_counter()
    for index in range(1, of.spec.sequence.motions + 1):
        task = MotionTask(of, stack, [np.zeros(len(c.labels)) for c in of.constraints])
        x = random_start(task, base_motion(task, seed), (seed, index, 0))
        alpha = task.coefficients(solver.solve(task, x, effort, lambda progress: None).x)
        found.append(alpha)
        numbers.append(task.objective.stacked_condition_number(alpha))
        stack = stack.with_rows(task.objective.block(alpha))
    return of, found, numbers, time.perf_counter() - began


def states_of(of: Problem, motions: Sequence[Array]) -> tuple[str, float]:
    """Verdicts of all motions in words, and the seconds per motion."""
    began = time.perf_counter()
    found = [v for alpha in motions for v in verdicts(of, alpha)]
    seconds = (time.perf_counter() - began) / len(motions)
    counts = {state: sum(v.state == state for v in found) for state in ("proved", "broken")}
    counts["sampled"] = len(found) - sum(counts.values())
    return ", ".join(f"{count} {state}" for state, count in counts.items() if count), seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=CONFIGS)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    arguments = parser.parse_args()
    print(f"{'config':12} {'seed':>4} {'':9} {'stacked condition numbers':28} {'s':>6}  verdicts")
    for name in arguments.configs:
        times, conditions = [], []
        for seed in arguments.seeds:
            pair = []
            for words in ("grid", "sampled", "proved"):
                if words == "grid":
                    of, motions, numbers, seconds = on_the_grid(name, seed)
                else:
                    of, result, seconds = solved(name, seed, words == "proved")
                    motions = [m.coefficients for m in result.motions]
                    numbers = [m.stacked_condition_number for m in result.motions]
                told, each = states_of(of, motions)
                pair.append((seconds, numbers[-1]))
                shown = "  ".join(f"{number:.2f}" for number in numbers)
                print(
                    f"{name:12} {seed:4} {words:9} {shown:28} {seconds:6.1f}  {told} "
                    f"({each:.2f} s each)",
                    flush=True,
                )
            times.append([pair[2][0] / other[0] for other in pair[:2]])
            conditions.append([pair[2][1] / other[1] for other in pair[:2]])
        for k, words in enumerate(("the grid only", "1 kHz samples")):
            print(
                f"{name}: proof takes {np.mean(times, axis=0)[k]:.2f} times as long as {words}, "
                f"condition number {np.mean(conditions, axis=0)[k]:.3f} times as high (means over "
                f"{len(times)} seeds)"
            )


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
