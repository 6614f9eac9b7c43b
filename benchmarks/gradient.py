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
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.task import MotionTask

OURS, BARE = "cost and gradient", "bare Pinocchio and LAPACK calls"
FEW, MANY = "… on 1 stacked motion", "… on 50 stacked motions"
FORWARD = "forward differences"


def main() -> None:
    of = problem("talos_arms", WITHOUT_GEOMETRY)
    alpha, task = motion(of), MotionTask(of)
    objective, criterion = task.objective, of.criterion
    stacks = {}
    for count in (1, 50):
        stack = Stack.empty(of.base.rank)
        for seed in range(count):
            stack = stack.with_rows(objective.block(motion(of, 100 + seed)))
        stacks[count] = of.objective(stack)

    def cost(x: object) -> float:
        return objective.value(x, criterion)

    fast = {
        BARE: BareCalls(of, alpha).run,
        "cost alone": lambda: cost(alpha),
        OURS: lambda: objective.value_and_gradient(alpha, criterion),
        FEW: lambda: stacks[1].value_and_gradient(alpha, criterion),
        MANY: lambda: stacks[50].value_and_gradient(alpha, criterion),
        "… smooth criterion, p = 4": lambda: objective.value_and_gradient(
            alpha, SmoothConditionNumber(4.0)
        ),
        "cost and gradient, block form": lambda: block_gradient(of, task, alpha),
    }
    slow = {
        FORWARD: lambda: forward_differences(cost, alpha),
        "central differences": lambda: central_differences(cost, alpha),
        # As many in a row as differences call the cost: both run from warm caches.
        "cost and gradient, 100 times": lambda: [fast[OURS]() for _ in range(100)],
    }
    found = interleaved(fast, 60) | interleaved(slow, 3)
    print(f"TALOS' arms: {of.variables} variables, {len(of.cost_basis.times)} samples, one thread")
    print(f"{'':40} {'ms':>9} {'× cost and gradient':>20}")
    for name, seconds in found.items():
        print(f"{name:40} {1e3 * seconds:9.2f} {seconds / found[OURS]:20.2f}")
    goals = ((OURS, BARE, "≤ 1.3"), (FORWARD, OURS, "≥ 100"), (MANY, FEW, "≤ 1.1"))
    for above, below, goal in goals:
        print(f"{f'{above} / {below}':60} {found[above] / found[below]:9.2f}   goal {goal}")
    whole_body()


def whole_body() -> None:
    """The same floor for 30 joints on a floating base, whose wrench is measured too."""
    of = problem("talos_whole_body", WITHOUT_GEOMETRY)
    alpha, objective = motion(of), of.objective()
    found = interleaved(
        {
            BARE: BareCalls(of, alpha).run,
            OURS: lambda: objective.value_and_gradient(alpha, of.criterion),
        },
        30,
    )
    print(f"\nTALOS, {of.robot.n} joints, floating base")
    for name, seconds in found.items():
        print(f"{name:40} {1e3 * seconds:9.2f}")
    print(f"{f'{OURS} / {BARE}':60} {found[OURS] / found[BARE]:9.2f}   goal ≤ 1.5")


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
