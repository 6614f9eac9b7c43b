"""Cost and gradient on TALOS' arms against block form, differences and the bare library calls.

Run: python -m benchmarks.gradient
"""

from threadpoolctl import threadpool_limits

from benchmarks.problems import WITHOUT_GEOMETRY, BareCalls, interleaved, motion, problem
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.excitation.gradient_check import (
    block_gradient,
    central_differences,
    forward_differences,
)
from excite_cli.excitation.stack import Stack
from excite_cli.excitation.task import MotionTask


def main() -> None:
    of = problem("talos_arms", WITHOUT_GEOMETRY)
    alpha, task = motion(of), MotionTask(of)
    objective, criterion = task.objective, of.criterion
    bare = BareCalls(of, alpha)
    stacks = {}
    for count in (1, 50):
        stack = Stack.empty(of.base.rank)
        for seed in range(count):
            stack = stack.with_rows(objective.block(motion(of, 100 + seed)))
        stacks[count] = of.objective(stack)
    fast = interleaved(
        {
            "bare Pinocchio and LAPACK calls": bare.run,
            "cost alone": lambda: objective.value(alpha, criterion),
            "cost and gradient": lambda: objective.value_and_gradient(alpha, criterion),
            "… on 1 stacked motion": lambda: stacks[1].value_and_gradient(alpha, criterion),
            "… on 50 stacked motions": lambda: stacks[50].value_and_gradient(alpha, criterion),
            "… smooth criterion, p = 4": lambda: objective.value_and_gradient(
                alpha, SmoothConditionNumber(4.0)
            ),
            "cost and gradient, block form": lambda: block_gradient(of, task, alpha),
        },
        60,
    )
    slow = interleaved(
        {
            "forward differences": lambda: forward_differences(
                lambda x: objective.value(x, criterion), alpha
            ),
            "central differences": lambda: central_differences(
                lambda x: objective.value(x, criterion), alpha
            ),
            # As many in a row as differences call the cost: both run from warm caches.
            "cost and gradient, 100 times": lambda: [
                objective.value_and_gradient(alpha, criterion) for _ in range(100)
            ],
        },
        3,
    )
    reference = fast["cost and gradient"]
    print(f"TALOS' arms: {of.variables} variables, {len(of.cost_basis.times)} samples, one thread")
    print(f"{'':40} {'ms':>9} {'× cost and gradient':>20}")
    for name, seconds in {**fast, **slow}.items():
        print(f"{name:40} {1e3 * seconds:9.2f} {seconds / reference:20.2f}")
    print()
    for name, ratio, goal in (
        (
            "cost and gradient / bare calls",
            reference / fast["bare Pinocchio and LAPACK calls"],
            "≤ 1.3",
        ),
        (
            "forward differences / cost and gradient",
            slow["forward differences"] / reference,
            "≥ 100",
        ),
        (
            "50 stacked motions / 1",
            fast["… on 50 stacked motions"] / fast["… on 1 stacked motion"],
            "≤ 1.1",
        ),
    ):
        print(f"{name:40} {ratio:9.2f}   goal {goal}")
    whole_body()


def whole_body() -> None:
    """The same floor for 30 joints on a floating base, whose wrench is measured too."""
    of = problem("talos_whole_body", WITHOUT_GEOMETRY)
    alpha, objective = motion(of), of.objective()
    bare = BareCalls(of, alpha)
    found = interleaved(
        {
            "bare": bare.run,
            "ours": lambda: objective.value_and_gradient(alpha, of.criterion),
        },
        30,
    )
    print(
        f"\nTALOS, {of.robot.n} joints, floating base: "
        f"cost and gradient {1e3 * found['ours']:.2f} ms, bare calls {1e3 * found['bare']:.2f} ms"
    )
    ratio = found["ours"] / found["bare"]
    print(f"{'cost and gradient / bare calls':40} {ratio:9.2f}   goal ≤ 1.5")


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
