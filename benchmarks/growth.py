"""How cost and gradient grow with joints, samples, harmonics and stacked motions.

Run: python -m benchmarks.growth
"""

import json

from threadpoolctl import threadpool_limits

from benchmarks.bare import BareCalls
from benchmarks.problems import WITHOUT_GEOMETRY, motion, problem
from benchmarks.timing import interleaved
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.stack import Stack

ARM = json.dumps([f"arm_left_{i}_joint" for i in range(1, 8)])


def row(label: str, of: Problem, stacked: int = 0) -> None:
    alpha = motion(of)
    stack = Stack.empty(of.base.rank)
    for seed in range(stacked):
        stack = stack.with_rows(of.objective().block(motion(of, 100 + seed)))
    objective, bare = of.objective(stack), BareCalls(of, alpha)
    found = interleaved(
        {
            "bare": bare.run,
            "gradient": lambda: objective.value_and_gradient(alpha, of.criterion),
            "smooth": lambda: objective.value_and_gradient(alpha, SmoothConditionNumber(4.0)),
        },
        15,
    )
    print(
        f"{label:34} {of.variables:5} {of.base.rank:5} {1e3 * found['bare']:9.2f} "
        f"{1e3 * found['gradient']:9.2f} {1e3 * found['smooth']:9.2f} "
        f"{found['gradient'] / found['bare']:8.2f}"
    )


def main() -> None:
    print(
        f"{'':34} {'var.':>5} {'base':>5} {'bare ms':>9} {'grad ms':>9} {'smooth ms':>9} "
        f"{'grad/bare':>9}"
    )
    arms = ("talos_arms", WITHOUT_GEOMETRY)
    row("7 joints", problem(*arms, f"robot.joints={ARM}", "robot.posture={}"))
    row("14 joints", problem(*arms))
    row("30 joints, floating base", problem("talos_whole_body", WITHOUT_GEOMETRY))
    row(
        "32 joints, floating base",
        problem("talos_whole_body", WITHOUT_GEOMETRY, "robot.joints=all"),
    )
    for samples in (20, 80, 160):
        row(
            f"14 joints, {samples} samples",
            problem(*arms, f"sampling.cost={{samples: {samples}, step: {8 / samples}}}"),
        )
    for harmonics in (5, 20):
        row(
            f"14 joints, {harmonics} harmonics", problem(*arms, f"trajectory.harmonics={harmonics}")
        )
    for stacked in (1, 10, 50):
        row(f"14 joints, {stacked} stacked motions", problem(*arms), stacked)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
