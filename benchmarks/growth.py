"""How time and memory grow with samples, joints and stacked motions: fitted exponents.

For each case: cost and gradient; one iteration of the whole optimisation with all constraints; the
peak of what is allocated while it runs (tracemalloc, so without the libraries themselves). Samples
are those of cost and of constraints together. An exponent e says: twice as many, 2^e times as much.

Run: python -m benchmarks.growth
"""

import json
import tracemalloc
from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import CONFIGS, BareCalls, interleaved, motion, problem
from excite_cli.config.load_spec import load_spec
from excite_cli.excitation.base_motion import base_motion
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.solvers.base import Effort
from excite_cli.excitation.solvers.interior_point import InteriorPoint
from excite_cli.excitation.start import random_start
from excite_cli.excitation.task import MotionTask

_ITERATIONS = 6
_REPEATS = 15
ARMS = [f"arm_{side}_{i}_joint" for side in ("left", "right") for i in range(1, 8)]
LEGS = [f"leg_{side}_{i}_joint" for side in ("left", "right") for i in range(1, 7)]
REST = ["torso_1_joint", "torso_2_joint", "head_1_joint", "head_2_joint"]
SETS = {7: ARMS[:7], 14: ARMS, 18: ARMS + REST, 30: ARMS + REST + LEGS}


# What grows: milliseconds of cost and gradient, and of one iteration; peak in MB.
GROWING = ("gradient ms", "iteration ms", "memory MB")


def measured(of: Problem, stacked: int = 0) -> dict[str, float]:
    """Those, and the ratio of cost and gradient to the bare calls."""
    alpha, stack = motion(of), Stack.empty(of.base.rank)
    for seed in range(stacked):
        stack = stack.with_rows(of.objective().block(motion(of, 100 + seed)))
    objective, bare = of.objective(stack), BareCalls(of, alpha)
    task = MotionTask(of, stack)
    x = random_start(task, base_motion(task, 1), (1, 1, 0))
    found = interleaved(
        {"bare": bare.run, "gradient": lambda: objective.value_and_gradient(alpha, of.criterion)},
        _REPEATS,
    )
    found |= interleaved({"iteration": lambda: _iterate(of, stack, x)}, 1)
    tracemalloc.start()
    _iterate(of, stack, x)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    grown = (1e3 * found["gradient"], 1e3 * found["iteration"] / _ITERATIONS, peak / 1e6)
    return dict(zip(GROWING, grown, strict=True)) | {"/ bare": found["gradient"] / found["bare"]}


def _iterate(of: Problem, stack: Stack, x: np.ndarray) -> None:
    effort = Effort(_ITERATIONS, 600.0, 0.0)
    InteriorPoint().solve(MotionTask(of, stack), x, effort, lambda progress: None)


def family(name: str, cases: Sequence[tuple[int, Problem, int]]) -> None:
    heads = (*GROWING, "/ bare")
    print(f"\n{name:>16} {'base par.':>10} " + " ".join(f"{head:>13}" for head in heads))
    costs = []
    for size, of, stacked in cases:
        costs.append(measured(of, stacked))
        cells = " ".join(f"{costs[-1][head]:13.2f}" for head in heads)
        print(f"{size:16} {of.base.rank:10} {cells}", flush=True)
    sizes = np.log([size for size, _, _ in cases])
    slopes = (np.polyfit(sizes, np.log([cost[what] for cost in costs]), 1)[0] for what in GROWING)
    print(f"{'exponent':>16} {'':10} " + " ".join(f"{each:13.2f}" for each in slopes))


def main() -> None:
    def sampled(k: int) -> Problem:
        return problem(
            "talos_arms",
            f"sampling.cost={{samples: {40 * k}, step: {0.2 / k}}}",
            f"sampling.constraints={{samples: {400 * k}, step: {0.02 / k}}}",
        )

    def with_joints(names: list[str]) -> Problem:
        limits = load_spec(CONFIGS / "talos_whole_body.yaml").robot.limits
        kept = {name: limit.model_dump() for name, limit in limits.items() if name in names}
        return problem(
            "talos_whole_body",
            f"robot.joints={json.dumps(names)}",
            f"robot.limits={json.dumps(kept)}",
            *("robot.base=fixed", "robot.rows=[joints]"),
        )

    family("cost samples", [(40 * k, sampled(k), 0) for k in (1, 2, 4, 8)])
    family("joints", [(count, with_joints(names), 0) for count, names in SETS.items()])
    arms = problem("talos_arms")
    family("stacked motions", [(count, arms, count) for count in (1, 5, 20, 50)])


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
