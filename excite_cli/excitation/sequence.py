"""Motions one after the other, each with all earlier ones stacked as C_0 (Eq. 41, section IV.B)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from excite_cli.excitation.generate import generate_motion
from excite_cli.excitation.motion import Motion, ProgressCallback
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.solvers.base import Solver
from excite_cli.excitation.stack import Stack


@dataclass(frozen=True)
class Step:
    """A finished motion and the stack that includes it."""

    motion: Motion
    stack: Stack


def generate_sequence(
    problem: Problem,
    solver: Solver,
    stack: Stack,
    indices: range,
    seed: int,
    report: Callable[[int], ProgressCallback],
) -> Iterator[Step]:
    """Yield motions `indices` (counted from 1), starting on top of `stack`.

    Each motion depends on the stack, the seed and its index only, so a sequence that is resumed
    from a stored stack goes on to the same numbers. `report(index)` gives the progress callback.
    """
    objective = problem.objective()
    for index in indices:
        motion = generate_motion(problem, solver, stack, index, seed, report(index))
        stack = stack.with_rows(objective.block(motion.coefficients))
        yield Step(motion, stack)
